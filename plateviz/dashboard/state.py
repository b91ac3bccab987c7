"""Selection and settings of one browser session; their bounds are enforced on the server."""

import re
from collections.abc import Mapping
from typing import Any

import param

from solver.data.parameters import PARAMETERS
from solver.data.prior_text import format_width
from solver.data.result import FitResult
from solver.data.setting_kinds import Change, Choice, Positive, Setting, Switch, Whole
from solver.data.settings import DEFAULTS, SETTINGS, FitSettings
from solver.data.text_setting import PriorWidths, Texts

ALL = "all"
_PLATES = re.compile(r"(-?\d+)-(-?\d+)")
_SOURCES = re.compile(r"-?\d{1,19}(,-?\d{1,19})*")
# Maximum number of sources in an address.
_FEW = 20
_LARGEST_ID = 2**63 - 1


class Selection(param.Parameterized):
    """The exposures, the detector and the sources that every view of the session shows.

    Sources are selected by id, and stay selected in an orbit that has not measured them.
    """

    orbit = param.Selector(doc="orbit on the screen")
    field = param.Selector(default=ALL, objects=[ALL], doc="field of the exposures, or all")
    plates = param.Range(default=(0, 0), bounds=(0, 0), step=1, doc="first and last exposure")
    detector = param.Selector(
        default=ALL, objects=[ALL], doc="detector of the residual map, or all"
    )
    sources = param.ClassSelector(
        class_=frozenset, default=frozenset(), doc="ids of the selected sources"
    )

    def __init__(self, **values: Any) -> None:  # noqa: ANN401 as param
        """Start without options."""
        super().__init__(**values)
        self._requested: dict[str, Any] = {}

    def limit_to(self, result: FitResult, detectors: list[int]) -> None:
        """Limit the options to those of a solution; a selection that is no option is reset."""
        exposures = result.exposures
        fields = [ALL, *(str(f) for f in sorted(exposures["field_id"].unique().tolist()))]
        plates = (int(exposures["plate_id"].min()), int(exposures["plate_id"].max()))
        numbers = [ALL, *(str(d) for d in detectors)]
        is_first = self.param["field"].objects == [ALL]
        self.param["field"].objects = fields
        self.param["detector"].objects = numbers
        self.param["plates"].bounds = plates
        selected: dict[str, Any] = self.address() | {"plates": self.plates}
        if is_first:
            selected |= {"field": fields[1], "detector": numbers[1], **self._requested}
        lowest, highest = (min(max(p, plates[0]), plates[1]) for p in selected["plates"])
        self.param.update(
            field=selected["field"] if selected["field"] in fields else ALL,
            detector=selected["detector"] if selected["detector"] in numbers else ALL,
            plates=(lowest, highest),
        )

    def restore(self, address: Mapping[str, str]) -> None:
        """Select what a page's address requests, once a solution is there; ignore invalid values.

        Parameters
        ----------
        address : query of the address, as from `address`; other keys are ignored
        """
        requested: dict[str, Any] = {k: address[k] for k in ("field", "detector") if k in address}
        plates = _PLATES.fullmatch(address.get("plates", ""))
        if plates:
            requested["plates"] = tuple(sorted(int(number) for number in plates.groups()))
        self._requested = requested
        if _SOURCES.fullmatch(address.get("sources", "")):
            ids = map(int, address["sources"].split(",")[:_FEW])
            self.sources = frozenset(one for one in ids if abs(one) <= _LARGEST_ID)
        orbits = {str(orbit): orbit for orbit in self.param["orbit"].objects}
        self.orbit = orbits.get(address.get("orbit", ""), self.orbit)

    def address(self) -> dict[str, str]:
        """Return the selection as the query of the page's address; `restore` reads it back.

        More than a few selected sources are left out.
        """
        first, last = self.plates
        query = {"field": self.field, "plates": f"{first}-{last}", "detector": self.detector}
        if 0 < len(self.sources) <= _FEW:
            query["sources"] = ",".join(map(str, sorted(self.sources)))
        return query if self.orbit is None else {"orbit": str(self.orbit), **query}

    @property
    def detector_id(self) -> int | None:
        """The selected detector, None for all."""
        return None if self.detector == ALL else int(self.detector)

    def exposures_of(self, result: FitResult) -> list[tuple[int, int]]:
        """Return (field_id, plate_id) of the selected exposures of a solution."""
        table = result.exposures
        selected = table["plate_id"].between(*self.plates)
        if self.field != ALL:
            selected &= table["field_id"] == int(self.field)
        pairs = table.loc[selected, ["field_id", "plate_id"]]
        return [(int(f), int(p)) for f, p in pairs.itertuples(index=False)]


class FitChoices(param.Parameterized):
    """The settings of the next fit: one parameter for each setting with a control.

    Prior widths are a dict of group name -> text; shifts and exclusions are one text each, as on
    the command line. The parameters are added below, from `solver.data.settings`.
    """

    what_if_at_once = param.Boolean(
        default=True, doc="whether a change of a control shows a what-if at once"
    )

    def __init__(self, **values: Any) -> None:  # noqa: ANN401 as param
        """Start from the paper's priors."""
        super().__init__(**values)
        self.prior_widths = default_widths()

    def settings(self) -> FitSettings:
        """Return the settings; InputError names an invalid one."""
        return FitSettings(
            **{name: _setting_value(one, getattr(self, name)) for name, one in CONTROLS.items()}
        )

    def load(self, settings: FitSettings) -> None:
        """Set the parameters to the values of `settings`."""
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


def _setting_value(one: Setting, control_value: Any) -> Any:  # noqa: ANN401
    """Return the value of a setting from the value of its control."""
    if isinstance(one, PriorWidths):
        defaults = default_widths()
        changed = {
            name: text for name, text in control_value.items() if text.strip() != defaults[name]
        }
        return one.parse(f"{name}={text}" for name, text in changed.items())
    if isinstance(one, Texts):
        return one.parse(control_value.replace(",", " ").split())
    return control_value


def _control_value(one: Setting, settings: FitSettings, name: str) -> Any:  # noqa: ANN401
    """Return the value of the control of a setting."""
    if isinstance(one, PriorWidths):
        return {g.name: format_width(g.name, settings.width(g.name)) for g in PARAMETERS}
    value = getattr(settings, name)
    return ", ".join(one.texts(value)) if isinstance(one, Texts) else value


for _name, _one in CONTROLS.items():
    FitChoices.param.add_parameter(_name, _parameter(_one, DEFAULTS[_name]))


def default_widths() -> dict[str, str]:
    """Return the paper's prior widths as texts."""
    return _control_value(SETTINGS["prior_widths"], FitSettings(), "prior_widths")
