"""RefitView: fit the orbit again with another order or other priors, watch it, stop it."""

from typing import Any

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.session import Session, Solution, Stage
from plateviz.dashboard.state import FitChoices, default_widths
from solver.data.parameters import PARAMETERS, Group

# Of a control that stands close to the next one.
_TIGHT = (0, 10)


class RefitView(pn.viewable.Viewer):
    """Controls of a refit, its progress, and the choice among the solutions made."""

    def __init__(self, session: Session, **params: object) -> None:
        """Follow `session`."""
        super().__init__(**params)
        self._session = session
        self._widths = {group.name: self._width_input(group) for group in PARAMETERS}
        self._reset = pmui.Button(label="The paper's priors", variant="text", size="small")
        self._fit = pmui.Button(label="Fit", color="primary", sizing_mode="stretch_width")
        self._keep = pmui.Button(
            label="Keep this solution", variant="outlined", sizing_mode="stretch_width"
        )
        self._stop = pmui.Button(
            label="Cancel", color="warning", variant="outlined", sizing_mode="stretch_width"
        )
        self._bar = pmui.LinearProgress(variant="indeterminate", sizing_mode="stretch_width")
        self._news = pmui.Alert(object="", sizing_mode="stretch_width", margin=(8, 10))
        self._solutions = pmui.RadioBoxGroup(label="Solution on the screen", options={})
        self._column = pmui.Column(
            *_model_inputs(session.choices),
            self._priors_card(),
            _exclusions_input(session.choices),
            _engine_input(session.choices),
            pmui.Row(self._fit, self._stop, sizing_mode="stretch_width", margin=0),
            self._bar,
            self._news,
            self._keep,
            self._solutions,
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
        self._keep.on_click(lambda _: session.keep())
        self._reset.on_click(self._take_defaults)
        self._solutions.param.watch(self._bring_up, "value")
        session.choices.param.watch(self._show_widths, "widths")
        session.param.watch(self._show_stage, ["stage", "message"])
        session.param.watch(self._show_solutions, ["solutions", "shown"])
        self._show_stage()
        self._show_solutions()

    def _priors_card(self) -> pmui.Card:
        entries: list[Any] = [
            *self._widths.values(),
            _shifts_input(self._session.choices),
            self._reset,
        ]
        return pmui.Card(
            *entries,
            title="Priors",
            collapsed=True,
            sizing_mode="stretch_width",
            margin=(8, 10),
            elevation=0,
            variant="outlined",
        )

    def _width_input(self, group: Group) -> pmui.TextInput:
        entry = pmui.TextInput(
            label=f"{group.label} ({group.symbol})",
            value=self._session.choices.widths[group.name],
            description=_explanation(group),
            size="small",
            sizing_mode="stretch_width",
        )

        def take(event: object) -> None:
            widths = self._session.choices.widths
            self._session.choices.widths = {**widths, group.name: event.new}  # type: ignore[attr-defined]

        entry.param.watch(take, "value")
        return entry

    def _take_defaults(self, _: object) -> None:
        self._session.choices.param.update(widths=default_widths(), shifts="")

    def _show_widths(self, *_: object) -> None:
        for name, text in self._session.choices.widths.items():
            self._widths[name].value = text

    def _show_stage(self, *_: object) -> None:
        stage, message = self._session.stage, self._session.message
        at_work = stage in (Stage.LOADING, Stage.STALE)
        self._bar.visible = at_work
        self._stop.disabled = not at_work
        self._news.param.update(
            object=message,
            visible=bool(message),
            severity="error" if stage is Stage.FAILED else "info",
        )

    def _show_solutions(self, *_: object) -> None:
        solutions = {solution.label: solution for solution in self._session.solutions}
        shown = self._session.shown
        self._keep.visible = False
        if shown is not None and shown.is_what_if:
            self._keep.visible = True
            solutions[shown.label] = shown
        # A value that is no option would be sent to the browser as it is.
        chosen = next((s for s in solutions.values() if s is shown), None)
        self._solutions.param.update(options=solutions, value=chosen, visible=len(solutions) > 1)

    def _bring_up(self, event: object) -> None:
        chosen = event.new  # type: ignore[attr-defined]
        if isinstance(chosen, Solution):
            self._session.bring_up(chosen)


def _model_inputs(choices: FitChoices) -> list[pn.viewable.Viewable]:
    """Return what the model is made of: the order of its distortion, and switches."""
    of = choices.param
    return [
        pmui.Switch.from_param(of.what_if_at_once, label="Try every change at once", margin=_TIGHT),
        pmui.IntSlider.from_param(of.order, label="Distortion order", sizing_mode="stretch_width"),
        pmui.Switch.from_param(of.aberration, label="Stellar aberration"),
        pmui.Switch.from_param(of.robust, label="Leave out outliers", margin=_TIGHT),
        pmui.Switch.from_param(of.compare_orders, label="Compare all orders", margin=_TIGHT),
    ]


def _engine_input(choices: FitChoices) -> pmui.Select:
    return pmui.Select.from_param(
        choices.param.engine, label="Engine", size="small", sizing_mode="stretch_width"
    )


def _exclusions_input(choices: FitChoices) -> pmui.TextInput:
    return pmui.TextInput.from_param(
        choices.param.exclusions,
        label="Leave out",
        placeholder="detector=1, exposure=0/3",
        description="source=ID, exposure=FIELD/PLATE or detector=ID, as many as you like.",
        size="small",
        sizing_mode="stretch_width",
    )


def _shifts_input(choices: FitChoices) -> pmui.TextInput:
    return pmui.TextInput.from_param(
        choices.param.shifts,
        label="Shift of the centres",
        placeholder="detector_x[2]=-5um",
        description="GROUP=SHIFT or GROUP[ELEMENT]=SHIFT, as many as you like. An element is "
        "FIELD/PLATE, a detector, K/L of a distortion term, or ra or dec of sources.",
        size="small",
        sizing_mode="stretch_width",
    )


def _explanation(group: Group) -> str:
    """Say what the number in a prior's box means."""
    if group.axis == "src":
        return "Factor on the catalogue's own uncertainties."
    if group.relative:
        return "Standard deviation as a fraction of the nominal value, or flat."
    return f"Standard deviation in {group.unit} (other units may be written), or flat."
