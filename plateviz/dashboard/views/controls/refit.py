"""RefitView: request fits and what-ifs of the orbit, show their progress, and cancel them."""

from collections.abc import Callable, Iterable

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.prior_widths import default_widths
from plateviz.dashboard.session.solution import Solution
from plateviz.dashboard.session.stage import Stage
from plateviz.dashboard.views.controls.fit_controls import TIGHT, controls, width_input
from plateviz.dashboard.views.dialogs.code_dialog import code_button
from plateviz.dashboard.views.dialogs.dialog import dialog_button
from plateviz.dashboard.views.dialogs.solution_dialog import SolutionDialog
from plateviz.dashboard.views.elements.markup import alert_words
from solver.data.parameter_group import Group
from solver.data.parameters import OPTIONAL_GROUPS, PARAMETERS
from solver.data.setting_kinds import Choice, Positive, Setting, Switch, Whole
from solver.data.text_setting import LeftOut, PriorShifts

# Each picture of the moving bar takes time from a solver on the same machine; a what-if is over
# before the bar moves.
_UNHURRIED = {
    "& .MuiLinearProgress-bar": {"animationDelay": "1s", "animationFillMode": "backwards"}
}

# All of the head of a card opens it, not only its mark, which by default has a grey of the light
# theme in both.
_HEAD = {
    "& .MuiCardHeader-root": {"position": "relative", "overflow": "hidden"},
    "& .MuiCardHeader-action .MuiIconButton-root": {
        "color": "text.primary",
        "&::after": {"content": '""', "position": "absolute", "inset": "-14px -400px"},
    },
}


class RefitView(pn.viewable.Viewer):
    """Controls of a refit, its progress, and the selection of a solution."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the session of `navigation`."""
        super().__init__(**params)
        self._session = session = navigation.session
        self._widths: dict[str, pmui.TextInput] = {}
        self._reset = pmui.Button(label="The paper's priors", variant="text", size="small")
        self._fit = pmui.Button(label="Fit", color="primary", sizing_mode="stretch_width")
        self._add = pmui.Button(
            label="Add to the list",
            description="Add to the list: the next what-if does not replace this one.",
            variant="outlined",
            sizing_mode="stretch_width",
        )
        self._stop = pmui.Button(
            label="Cancel", color="warning", variant="outlined", sizing_mode="stretch_width"
        )
        self._bar = pmui.LinearProgress(
            variant="indeterminate", sizing_mode="stretch_width", sx=_UNHURRIED
        )
        self._message = pmui.Alert(object="", sizing_mode="stretch_width", margin=(8, 10))
        self._solutions = pmui.RadioBoxGroup(label="Solution on the screen", options={})
        open_list, list_place = dialog_button("All solutions", lambda: SolutionDialog(navigation))
        self._reproduce, code_place = code_button(navigation)
        self._column = pmui.Column(
            pmui.Switch.from_param(
                session.choices.param.what_if_at_once,
                label="What-if at every change",
                margin=TIGHT,
            ),
            *controls(session.choices, Whole, Positive, Switch).values(),
            self._card("Priors", self._fill_priors),
            self._card("Causes of errors", self._fill_causes),
            *controls(session.choices, LeftOut, Choice).values(),
            pmui.Row(self._fit, self._stop, sizing_mode="stretch_width", margin=0),
            self._bar,
            self._message,
            self._add,
            self._solutions,
            pmui.Row(open_list, self._reproduce, margin=0),
            code_place,
            list_place,
            sizing_mode="stretch_width",
            margin=0,
        )
        self._connect()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the controls."""
        return self._column

    def _connect(self) -> None:
        session = self._session
        self._fit.on_click(lambda _: session.refit())
        self._stop.on_click(lambda _: session.cancel())
        self._add.on_click(lambda _: session.list_what_if())
        self._reset.on_click(self._reset_priors)
        self._solutions.param.watch(self._select, "value")
        session.choices.param.watch(self._show_widths, "prior_widths")
        session.param.watch(self._show_stage, ["stage", "message", "is_brief"])
        session.param.watch(self._show_solutions, ["solutions", "shown"])
        session.journal.param.watch(self._show_solutions, "made")
        self._show_stage()
        self._show_solutions()

    def _card(self, title: str, fill: Callable[[], list[pn.viewable.Viewable]]) -> pmui.Card:
        """Return a closed card that is filled when it is opened: most people never open it."""
        card = pmui.Card(
            title=title,
            collapsed=True,
            sizing_mode="stretch_width",
            margin=(8, 10),
            elevation=0,
            variant="outlined",
            sx=_HEAD,
        )

        def opened(*_: object) -> None:
            if not len(card.objects):
                card[:] = fill()

        card.param.watch(opened, "collapsed")
        return card

    def _fill_priors(self) -> list[pn.viewable.Viewable]:
        widths = self._width_inputs(group for group in PARAMETERS if not group.setting)
        shifts = controls(self._session.choices, PriorShifts).values()
        return [*widths, *shifts, self._reset]

    def _fill_causes(self) -> list[pn.viewable.Viewable]:
        """Return the controls of the causes, each followed by the priors of its groups."""
        choices, filled = self._session.choices, []
        for name, control in controls(choices, Setting, is_cause=True).items():
            widths = self._width_inputs(group for group in OPTIONAL_GROUPS if group.setting == name)
            filled += [control, *widths]
            self._show_if_on(name, widths)
        return filled

    def _show_if_on(self, name: str, widths: list[pmui.TextInput]) -> None:
        """Show the prior widths of a cause while its setting is on."""

        def show(*_: object) -> None:
            for entry in widths:
                entry.visible = bool(getattr(self._session.choices, name))

        self._session.choices.param.watch(show, name)
        show()

    def _width_inputs(self, groups: Iterable[Group]) -> list[pmui.TextInput]:
        inputs = {group.name: width_input(self._session.choices, group) for group in groups}
        self._widths |= inputs
        return list(inputs.values())

    def _reset_priors(self, _: object) -> None:
        self._session.choices.param.update(prior_widths=default_widths(), prior_shifts="")

    def _show_widths(self, *_: object) -> None:
        for name, entry in self._widths.items():
            entry.value = self._session.choices.prior_widths[name]

    def _show_stage(self, *_: object) -> None:
        stage = self._session.stage
        message = "" if self._session.is_brief else self._session.message
        is_busy = stage in (Stage.LOADING, Stage.STALE)
        self._bar.visible = is_busy
        self._stop.disabled = not is_busy
        self._message.param.update(
            object=alert_words(message),
            visible=bool(message),
            severity="error" if stage is Stage.FAILED else "info",
        )

    def _show_solutions(self, *_: object) -> None:
        shown, listed = self._session.shown, list(self._session.solutions)
        self._reproduce.visible = shown is not None
        self._add.visible = shown is not None and shown.is_replaceable
        # A what-if, or after a blink the solution of another run. Of a value that is not among
        # the options, the browser makes the first of them, as if a person had chosen it.
        if shown is not None and not any(one is shown for one in listed):
            listed.append(shown)
        solutions: dict[str, Solution] = {}
        labels = [self._session.journal.label(one) for one in listed]
        for number, (label, solution) in enumerate(zip(labels, listed, strict=True)):
            # Different sources may be left out, of which the label has the number only.
            same = labels[:number].count(label)
            solutions[label + (f" ({same + 1})" if same else "")] = solution
        chosen = next((s for s in solutions.values() if s is shown), None)
        self._solutions.param.update(options=solutions, value=chosen, visible=len(solutions) > 1)

    def _select(self, event: object) -> None:
        chosen = event.new  # type: ignore[attr-defined]
        if isinstance(chosen, Solution):
            self._session.bring_up(chosen)
