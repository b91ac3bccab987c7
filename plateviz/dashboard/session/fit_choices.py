"""FitChoices: the settings of the next fit in one browser session."""

from typing import Any

import param

from plateviz.dashboard.session.prior_widths import default_widths, width_texts, widths_of
from solver.data.setting_kinds import Change, Choice, Positive, Setting, Switch, Whole
from solver.data.settings import DEFAULTS, SETTINGS, FitSettings
from solver.data.text_setting import PriorWidths, Texts


class FitChoices(param.Parameterized):
    """The settings of the next fit: one parameter for each setting with a control.

    Prior widths are a dict of group name -> text; shifts and exclusions are one text each, as on
    the command line. The parameters are added below, from `solver.data.settings`. Bounds are
    enforced on the server.
    """

    what_if_at_once = param.Boolean(
        default=True, doc="whether a change of a control shows a what-if at once"
    )

    typed = param.Dict(
        default={}, doc="group -> prior width that a person is typing and has not entered yet"
    )

    def __init__(self, **values: Any) -> None:  # noqa: ANN401 as param
        """Start from the paper's priors."""
        super().__init__(**values)
        self._loaded = FitSettings()
        self.prior_widths = default_widths()

    def settings(self) -> FitSettings:
        """Return the settings; InputError names an invalid one.

        Those without a control are as of the last `load`.
        """
        return self._loaded.with_(
            **{
                name: _setting_value(one, getattr(self, name), self._loaded)
                for name, one in CONTROLS.items()
            }
        )

    def typed_settings(self) -> FitSettings:
        """Return the settings with the widths that are being typed; InputError as `settings`."""
        widths = widths_of({**self.prior_widths, **self.typed}, self._loaded)
        return self.settings().with_(prior_widths=widths)

    def load(self, settings: FitSettings) -> None:
        """Set the parameters to the values of `settings`."""
        self._loaded = settings
        values = {name: _control_value(one, settings, name) for name, one in CONTROLS.items()}
        self.param.update(**values)


CONTROLS = {name: one for name, one in SETTINGS.items() if one.control}
# Controls whose change shows a what-if at once.
ANSWERED_AT_ONCE = tuple(n for n, one in CONTROLS.items() if one.change is not Change.ON_REQUEST)


def _parameter(one: Setting, default: Any) -> param.Parameter:  # noqa: ANN401
    """Return the param parameter of a setting; param enforces its bounds on the server."""
    if isinstance(one, Switch):
        return param.Boolean(default=default, doc=one.help)
    if isinstance(one, Whole):
        return param.Integer(default=default, bounds=(one.low, one.high), doc=one.help)
    if isinstance(one, Positive):
        return param.Number(
            default=default, bounds=(0.0, None), inclusive_bounds=(False, True), doc=one.help
        )
    if isinstance(one, Choice):
        return param.Selector(default=default, objects=list(one.names), doc=one.help)
    if isinstance(one, PriorWidths):
        return param.Dict(default={}, doc=one.help)
    if isinstance(one, Texts):
        return param.String(default="", doc=one.help)
    raise TypeError(f"{one.label}: expected a setting with a control, found a {type(one).__name__}")


def _setting_value(one: Setting, control_value: Any, loaded: FitSettings) -> Any:  # noqa: ANN401
    """Return the value of a setting from that of its control, which was made from `loaded`."""
    if isinstance(one, PriorWidths):
        return widths_of(control_value, loaded)
    if isinstance(one, Texts):
        return one.parse_line(control_value)
    return control_value


def _control_value(one: Setting, settings: FitSettings, name: str) -> Any:  # noqa: ANN401
    """Return the value of the control of a setting."""
    if isinstance(one, PriorWidths):
        return width_texts(settings)
    value = getattr(settings, name)
    return ", ".join(one.texts(value)) if isinstance(one, Texts) else value


for _name, _one in CONTROLS.items():
    FitChoices.param.add_parameter(_name, _parameter(_one, DEFAULTS[_name]))
