"""ShownPart: the orbit on the screen of one browser session, and what of it every view shows."""

from collections.abc import Iterable, Mapping
from typing import Any

import param

from plateviz.dashboard.address_parts import quoted
from plateviz.dashboard.session.shown_address import SHOWN, read_shown, shown_parts
from solver.data.result import FitResult
from solver.errors import InputError

ALL = "all"
# Orbits that a message names one by one.
_MOST_NAMED = 8


class ShownPart(param.Parameterized):
    """The orbit on the screen, and its field, exposures and detector that figures show.

    Some figures draw no other measurements. What can be shown is decided by the solution.
    """

    orbit = param.Selector(doc="orbit on the screen")
    field = param.Selector(default=ALL, objects=[ALL], doc="field of the exposures, or all")
    plates = param.Range(default=(0, 0), bounds=(0, 0), step=1, doc="first and last exposure")
    detector = param.Selector(
        default=ALL, objects=[ALL], doc="detector of the residual map, or all"
    )

    def __init__(self, **values: Any) -> None:  # noqa: ANN401
        """Begin without an orbit."""
        super().__init__(**values)
        self._requested = dict[str, Any]()
        self.param.watch(self._forget_requested, [*SHOWN])

    def offer_orbits(self, orbits: Iterable[int | None]) -> None:
        """Let `orbits` be what can be shown; the first one is, at first."""
        offered = list(orbits)
        is_first = not self.param["orbit"].objects
        if offered != list(self.param["orbit"].objects):
            self.param["orbit"].objects = offered
        if is_first:
            self.orbit = offered[0]

    def subject(self) -> str:
        """Return the orbit on the screen as it is named in files, such as "orbit-3"."""
        return f"orbit-{self.orbit}"

    def limit_to(self, result: FitResult, detectors: list[int]) -> list[str]:
        """Limit the options to those of a solution; what is no option is no longer shown.

        Returns
        -------
        What of the last address is no option, in words.
        """
        # Controls may answer to other options.
        requested, self._requested = self._requested, {}
        exposures = result.exposures
        fields = [ALL, *(str(f) for f in sorted(exposures["field_id"].unique().tolist()))]
        plates = (int(exposures["plate_id"].min()), int(exposures["plate_id"].max()))
        numbers = [ALL, *(str(d) for d in detectors)]
        is_first = not self._is_limited
        self.param["field"].objects = fields
        self.param["detector"].objects = numbers
        self.param["plates"].bounds = plates
        wanted: dict[str, Any] = {name: getattr(self, name) for name in SHOWN}
        if is_first:
            wanted |= {"field": fields[1], "detector": numbers[1]}
        wanted |= requested
        lowest, highest = (min(max(p, plates[0]), plates[1]) for p in wanted["plates"])
        found = {
            "field": wanted["field"] if wanted["field"] in fields else ALL,
            "detector": wanted["detector"] if wanted["detector"] in numbers else ALL,
            "plates": (lowest, highest),
        }
        self.param.update(**found)
        options = {
            "field": ", ".join(fields),
            "detector": ", ".join(numbers),
            "plates": f"exposures from {plates[0]} to {plates[1]}",
        }
        return [
            f"{name}: expected {options[name]}, found {quoted(value)}"
            for name, value in requested.items()
            if found[name] != value
        ]

    def restore(self, address: Mapping[str, str]) -> list[str]:
        """Show what a page's address requests, once a solution is there; ignore invalid values.

        Parameters
        ----------
        address : query of the address, as from `address`; other keys, and the orbit, are ignored

        Returns
        -------
        The invalid values, in words.
        """
        self._requested, problems = read_shown(address)
        return problems

    def orbit_of(self, address: Mapping[str, str]) -> int | None:
        """Return the orbit that an address names, by default the one on the screen.

        Raises
        ------
        InputError
            If there is no such orbit.
        """
        if "orbit" not in address:
            return self.orbit
        orbits = {str(orbit): orbit for orbit in self.param["orbit"].objects}
        if address["orbit"] not in orbits:
            known = [*orbits]
            words = f"{known[0]} to {known[-1]}" if len(known) > _MOST_NAMED else ", ".join(known)
            raise InputError(f"orbit: expected one of {words}, found {quoted(address['orbit'])}")
        return orbits[address["orbit"]]

    def address(self) -> dict[str, str]:
        """Return what is shown as the query of the page's address; `restore` reads it back.

        What is shown of an orbit is not decided before one is there, unless it was requested.
        """
        shown = {name: getattr(self, name) for name in SHOWN} if self._is_limited else {}
        query = shown_parts(shown | self._requested)
        return query if self.orbit is None else {"orbit": str(self.orbit), **query}

    @property
    def _is_limited(self) -> bool:
        """Whether the options are those of a solution."""
        return self.param["field"].objects != [ALL]

    def _forget_requested(self, *events: param.parameterized.Event) -> None:
        """Let hold what a person chooses while an orbit is being loaded."""
        for event in events:
            self._requested.pop(event.name, None)

    @property
    def detector_id(self) -> int | None:
        """The shown detector, None for all."""
        return None if self.detector == ALL else int(self.detector)

    def exposures_of(self, result: FitResult) -> list[tuple[int, int]]:
        """Return (field_id, plate_id) of the shown exposures of a solution."""
        fields, plates = (result.exposures[name].to_numpy() for name in ("field_id", "plate_id"))
        first, last = self.plates
        is_shown = (plates >= first) & (plates <= last)
        if self.field != ALL:
            is_shown &= fields == int(self.field)
        return list(zip(fields[is_shown].tolist(), plates[is_shown].tolist(), strict=True))
