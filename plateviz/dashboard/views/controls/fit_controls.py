"""Controls of the settings of a fit, made from the table of settings and that of parameters."""

from collections.abc import Callable
from functools import partial

import panel as pn
import panel_material_ui as pmui
from param.parameterized import Event

from plateviz.dashboard.session.fit_choices import CONTROLS, FitChoices
from plateviz.dashboard.session.prior_widths import completed_width
from plateviz.dashboard.views.elements.at_once import taken_at_once
from solver.data.parameter_group import Group
from solver.data.prior_text import parse_width
from solver.data.setting_kinds import Choice, Positive, Setting, Switch, Whole
from solver.data.settings import SETTINGS
from solver.data.text_setting import Texts
from solver.errors import InputError

# Margin of a control close to the next one.
TIGHT = (0, 10)


def controls(
    choices: FitChoices, *kinds: type[Setting], is_cause: bool = False
) -> dict[str, pn.viewable.Viewable]:
    """Return the controls of the settings of some kinds, in the order of the kinds, by name.

    Parameters
    ----------
    is_cause : whether the settings add causes to the model
    """
    found = {
        name: _control(choices, name)
        for kind in kinds
        for name, one in CONTROLS.items()
        if isinstance(one, kind) and one.is_cause == is_cause
    }
    taken_at_once(*found.values())
    return found


def width_input(choices: FitChoices, group: Group) -> pmui.TextInput:
    """Return the control of the prior width of a group."""
    entry = pmui.TextInput(
        label=f"{group.label} ({group.symbol})",
        value=choices.prior_widths[group.name],
        description=_explanation(group),
        size="small",
        sizing_mode="stretch_width",
    )

    def take(event: Event) -> None:
        entry.value = completed_width(group, event.new)
        if entry.value != event.new:
            # Taken by then.
            return
        choices.param.update(typed={}, prior_widths={**choices.prior_widths, group.name: event.new})

    def note(event: Event) -> None:
        is_typed = event.new != entry.value
        choices.typed = {group.name: event.new} if is_typed else {}

    entry.param.watch(take, "value")
    entry.param.watch(note, "value_input")
    _say_faults(entry, partial(parse_width, group.name))
    taken_at_once(entry)
    return entry


def _say_faults(entry: pmui.TextInput, parse: Callable[[str], object]) -> None:
    """Say below an entry what is wrong with its text, as `parse` finds it."""

    def look(*_: object) -> None:
        fault = ""
        try:
            parse(entry.value)
        except InputError as error:
            # What stands before the first colon is the name of the entry.
            fault = str(error).split(": ", 1)[-1]
            fault = f"{fault[0].upper()}{fault[1:]}."
        entry.param.update(error_state=bool(fault), helper_text=fault)

    entry.param.watch(look, "value")
    look()


def _control(choices: FitChoices, name: str) -> pn.viewable.Viewable:
    """Return the control of a setting."""
    one, parameter = SETTINGS[name], choices.param[name]
    if isinstance(one, Switch):
        return pmui.Switch.from_param(parameter, label=one.label, margin=TIGHT)
    if isinstance(one, Whole) and one.high is None:
        return pmui.IntInput.from_param(
            parameter,
            label=one.label,
            description=one.help,
            size="small",
            sizing_mode="stretch_width",
        )
    if isinstance(one, Whole):
        return pmui.IntSlider.from_param(parameter, label=one.label, sizing_mode="stretch_width")
    if isinstance(one, Positive):
        return pmui.FloatInput.from_param(
            parameter,
            label=f"{one.label} ({one.unit})" if one.unit else one.label,
            description=one.help,
            size="small",
            sizing_mode="stretch_width",
        )
    if isinstance(one, Choice):
        return pmui.Select.from_param(
            parameter, label=one.label, size="small", sizing_mode="stretch_width"
        )
    entry = pmui.TextInput.from_param(
        parameter,
        label=one.label,
        placeholder=one.example if isinstance(one, Texts) else "",
        description=one.help,
        size="small",
        sizing_mode="stretch_width",
    )
    if isinstance(one, Texts):
        _say_faults(entry, one.parse_line)
    return entry


def _explanation(group: Group) -> str:
    """Return the tooltip of the control of a prior width."""
    if group.axis == "src":
        return "Factor on the catalogue's own uncertainties."
    if group.relative:
        return "Standard deviation as a fraction of the nominal value, or flat."
    return f"Standard deviation in {group.unit} or another unit that is given, or flat."
