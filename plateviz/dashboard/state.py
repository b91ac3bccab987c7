"""What the user of one browser session has chosen; bounds are enforced here, on the server."""

import re
from collections.abc import Mapping
from itertools import starmap
from typing import Any

import param

from solver.data.exclusions import parse_exclusions
from solver.data.parameters import PARAMETERS
from solver.data.prior_text import format_shift, format_width, parse_shift, parse_width
from solver.data.result import FitResult
from solver.data.settings import ENGINES, MAX_ORDER, FitSettings

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
    """What a refit is to use; prior widths are kept as the words that people write."""

    what_if_at_once = param.Boolean(default=True, doc="whether a change is tried out at once")
    engine = param.Selector(default=ENGINES[0], objects=list(ENGINES), doc="engine of a refit")
    order = param.Integer(default=5, bounds=(0, MAX_ORDER), doc="order of the distortion")
    aberration = param.Boolean(default=True, doc="stellar aberration in the model")
    robust = param.Boolean(default=False, doc="whether outliers are looked for and left out")
    compare_orders = param.Boolean(default=False, doc="whether a fit compares all orders")
    widths = param.Dict(default={}, doc="group name -> prior width as text")
    shifts = param.String(default="", doc="where priors are centred, as on the command line")
    exclusions = param.String(default="", doc="what is left out, as on the command line")

    def __init__(self, **values: Any) -> None:  # noqa: ANN401 as param
        """Start from the paper's priors."""
        super().__init__(**values)
        self.widths = default_widths()

    def settings(self) -> FitSettings:
        """Return the choices as settings; InputError says which of them cannot be used."""
        defaults = default_widths()
        changed = {
            name: parse_width(name, text)
            for name, text in self.widths.items()
            if text.strip() != defaults[name]
        }
        return FitSettings(
            order=self.order,
            engine=self.engine,
            aberration=self.aberration,
            robust=self.robust,
            compare_orders=self.compare_orders,
            prior_widths=changed,
            prior_shifts=dict(map(parse_shift, _words(self.shifts))),
            exclusions=parse_exclusions(_words(self.exclusions)),
        )

    def take(self, settings: FitSettings) -> None:
        """Show the choices that `settings` were made from."""
        widths = {g.name: format_width(g.name, settings.width(g.name)) for g in PARAMETERS}
        self.param.update(
            order=settings.order,
            engine=settings.engine,
            aberration=settings.aberration,
            robust=settings.robust,
            compare_orders=settings.compare_orders,
            widths=widths,
            shifts=", ".join(starmap(format_shift, settings.prior_shifts.items())),
            exclusions=", ".join(n.replace(" ", "=") for n in settings.exclusions.names()),
        )


def _words(text: str) -> list[str]:
    return text.replace(",", " ").split()


def default_widths() -> dict[str, str]:
    """Return the paper's prior widths as people write them."""
    defaults = FitSettings()
    return {g.name: format_width(g.name, defaults.width(g.name)) for g in PARAMETERS}


def describe(settings: FitSettings) -> str:
    """Return the choices of a fit in a few words, the paper's priors going without saying."""
    words = [f"order {settings.order}"]
    if settings.engine != ENGINES[0]:
        words.append(settings.engine)
    words += [f"{name} {format_width(name, w)}" for name, w in _changed(settings).items()]
    words += starmap(format_shift, settings.prior_shifts.items())
    if not settings.aberration:
        words.append("no aberration")
    if settings.robust:
        words.append("without outliers")
    if settings.compare_orders:
        words.append("orders compared")
    words += [f"without {name}" for name in settings.exclusions.names()]
    return ", ".join(words)


def _changed(settings: FitSettings) -> Mapping[str, float]:
    defaults = FitSettings()
    return {n: w for n, w in settings.prior_widths.items() if w != defaults.width(n)}
