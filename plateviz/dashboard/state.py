"""What the user of one browser session has chosen; bounds are enforced here, on the server."""

import re
from collections.abc import Mapping
from typing import Any

import param

from solver.data.parameters import PARAMETERS
from solver.data.prior_text import format_width
from solver.data.result import FitResult
from solver.data.setting import Change, Choice, Positive, Setting, Switch, Whole
from solver.data.settings import DEFAULTS, SETTINGS, FitSettings
from solver.data.text_setting import PriorWidths, Texts

ALL = "all"
_PLATES = re.compile(r"(-?\d+)-(-?\d+)")


class Selection(param.Parameterized):
    """The exposures and the detector that every view of the session shows."""

    orbit = param.Selector(doc="orbit on the screen")
    field = param.Selector(default=ALL, objects=[ALL], doc="field of the exposures, or all")
    plates = param.Range(default=(0, 0), bounds=(0, 0), step=1, doc="first and last exposure")
    detector = param.Selector(
        default=ALL, objects=[ALL], doc="detector of the residual map, or all"
    )

    def __init__(self, **values: Any) -> None:  # noqa: ANN401 as param
        """Start with nothing to choose from."""
        super().__init__(**values)
        self._wanted: dict[str, Any] = {}

    def fit_to(self, result: FitResult, detectors: list[int]) -> None:
        """Offer what a solution holds; choices that it does not hold are given up."""
        exposures = result.exposures
        fields = [ALL, *(str(f) for f in sorted(exposures["field_id"].unique().tolist()))]
        plates = (int(exposures["plate_id"].min()), int(exposures["plate_id"].max()))
        numbers = [ALL, *(str(d) for d in detectors)]
        first = self.param["field"].objects == [ALL]
        self.param["field"].objects = fields
        self.param["detector"].objects = numbers
        self.param["plates"].bounds = plates
        wanted: dict[str, Any] = self.address() | {"plates": self.plates}
        if first:
            wanted |= {"field": fields[1], "detector": numbers[1], **self._wanted}
        lowest, highest = (min(max(p, plates[0]), plates[1]) for p in wanted["plates"])
        self.param.update(
            field=wanted["field"] if wanted["field"] in fields else ALL,
            detector=wanted["detector"] if wanted["detector"] in numbers else ALL,
            plates=(lowest, highest),
        )

    def want(self, address: Mapping[str, str]) -> None:
        """Take the wishes of a page's address; what no solution holds will be ignored.

        Parameters
        ----------
        address : as from `address`; anything else in it is not looked at
        """
        wanted: dict[str, Any] = {k: address[k] for k in ("field", "detector") if k in address}
        plates = _PLATES.fullmatch(address.get("plates", ""))
        if plates:
            wanted["plates"] = tuple(sorted(int(number) for number in plates.groups()))
        self._wanted = wanted
        orbits = {str(orbit): orbit for orbit in self.param["orbit"].objects}
        self.orbit = orbits.get(address.get("orbit", ""), self.orbit)

    def address(self) -> dict[str, str]:
        """Return the selection as words for the page's address, which `want` reads back."""
        first, last = self.plates
        words = {"field": self.field, "plates": f"{first}-{last}", "detector": self.detector}
        return words if self.orbit is None else {"orbit": str(self.orbit), **words}

    @property
    def detector_id(self) -> int | None:
        """The chosen detector, None for all."""
        return None if self.detector == ALL else int(self.detector)

    def exposures_of(self, result: FitResult) -> list[tuple[int, int]]:
        """Return (field_id, plate_id) of the chosen exposures that the solution holds."""
        table = result.exposures
        chosen = table["plate_id"].between(*self.plates)
        if self.field != ALL:
            chosen &= table["field_id"] == int(self.field)
        pairs = table.loc[chosen, ["field_id", "plate_id"]]
        return [(int(f), int(p)) for f, p in pairs.itertuples(index=False)]


class FitChoices(param.Parameterized):
    """The settings of the next fit, a parameter for each that has a control.

    Prior widths are a dict of group name -> text; shifts and exclusions are one text each, as on
    the command line. The parameters are added below, from `solver.data.settings`.
    """

    what_if_at_once = param.Boolean(default=True, doc="whether a change is answered at once")

    def __init__(self, **values: Any) -> None:  # noqa: ANN401 as param
        """Start from the paper's priors."""
        super().__init__(**values)
        self.prior_widths = default_widths()

    def settings(self) -> FitSettings:
        """Return the settings; InputError says which of them cannot be used."""
        return FitSettings(
            **{name: _value(one, getattr(self, name)) for name, one in CONTROLS.items()}
        )

    def take(self, settings: FitSettings) -> None:
        """Show the values of `settings`."""
        values = {name: _shown(one, settings, name) for name, one in CONTROLS.items()}
        self.param.update(**values)


CONTROLS = {name: one for name, one in SETTINGS.items() if one.control}
# Controls whose change is answered at once.
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
    raise TypeError(f"{one.label}: there is no control for a {type(one).__name__}")


def _value(one: Setting, shown: Any) -> Any:  # noqa: ANN401
    """Return the value of a setting from what its control shows."""
    if isinstance(one, PriorWidths):
        defaults = default_widths()
        changed = {name: text for name, text in shown.items() if text.strip() != defaults[name]}
        return one.parse(f"{name}={text}" for name, text in changed.items())
    if isinstance(one, Texts):
        return one.parse(shown.replace(",", " ").split())
    return shown


def _shown(one: Setting, settings: FitSettings, name: str) -> Any:  # noqa: ANN401
    """Return what the control of a setting shows."""
    if isinstance(one, PriorWidths):
        return {g.name: format_width(g.name, settings.width(g.name)) for g in PARAMETERS}
    value = getattr(settings, name)
    return ", ".join(one.texts(value)) if isinstance(one, Texts) else value


for _name, _one in CONTROLS.items():
    FitChoices.param.add_parameter(_name, _parameter(_one, DEFAULTS[_name]))


def default_widths() -> dict[str, str]:
    """Return the paper's prior widths as people write them."""
    return _shown(SETTINGS["prior_widths"], FitSettings(), "prior_widths")
