"""Selection: what one browser session shows and selects; bounds are enforced on the server."""

from collections.abc import Iterable, Mapping
from typing import Any

import param

from plateviz.dashboard.address_parts import quoted
from plateviz.dashboard.selection.large_selections import LargeSelections
from plateviz.dashboard.selection.selected import NO_IDS, SelectedIds, address_of, ids_of
from plateviz.dashboard.selection.selection_address import restored
from plateviz.dashboard.selection.shown_address import SHOWN, read_shown, shown_parts
from solver.data.result import FitResult
from solver.data.subset import KINDS, NOTHING, Subset
from solver.errors import InputError

ALL = "all"
# Orbits that a message names one by one.
_MOST_NAMED = 8


class Selection(param.Parameterized):
    """What every view of the session shows, and what is selected in it.

    `field`, `plates` and `detector` are the shown measurements: some figures draw no others.
    `sources`, `exposures` and `detectors` are selected: figures let them stand out among what is
    shown, and they can be left out of the fit. They are selected by id, and stay selected in an
    orbit that has not measured them.
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
    exposures = param.ClassSelector(
        class_=frozenset, default=frozenset(), doc="(field_id, plate_id) of those selected"
    )
    detectors = param.ClassSelector(
        class_=frozenset, default=frozenset(), doc="ids of the selected detectors"
    )
    kept = param.Dict(default={}, doc="name -> `Subset` that is kept; replaced, not changed")

    def __init__(self, large: LargeSelections | None = None, **values: Any) -> None:  # noqa: ANN401
        """Start without options.

        Parameters
        ----------
        large : of the server; None for those of this session alone
        """
        super().__init__(**values)
        self._requested, self._selected = dict[str, Any](), NOTHING
        self._ids: tuple[Subset, SelectedIds] = (NOTHING, NO_IDS)
        self.large = large or LargeSelections()
        self.param.watch(lambda *_: self.large.remember(self.selected), [*KINDS])
        self.param.watch(self._forget_requested, [*SHOWN])

    def offer_orbits(self, orbits: Iterable[int | None]) -> None:
        """Let `orbits` be what can be selected; the first one is, at first."""
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
        """Limit the options to those of a solution; a selection that is no option is reset.

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
        selected: dict[str, Any] = {name: getattr(self, name) for name in SHOWN}
        if is_first:
            selected |= {"field": fields[1], "detector": numbers[1]}
        selected |= requested
        lowest, highest = (min(max(p, plates[0]), plates[1]) for p in selected["plates"])
        found = {
            "field": selected["field"] if selected["field"] in fields else ALL,
            "detector": selected["detector"] if selected["detector"] in numbers else ALL,
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
        """Select what a page's address requests, once a solution is there; ignore invalid values.

        Parameters
        ----------
        address : query of the address, as from `address`; other keys, and the orbit, are ignored

        Returns
        -------
        The invalid values, in words.
        """
        self._requested, problems = read_shown(address)
        return problems + self._restore_selected(address)

    def orbit_of(self, address: Mapping[str, str]) -> int | None:
        """Return the orbit that an address names, by default the selected one.

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
        """Return the selection as the query of the page's address; `restore` reads it back.

        What is shown of an orbit is not decided before one is there, unless it was requested.
        """
        shown = {name: getattr(self, name) for name in SHOWN} if self._is_limited else {}
        query = shown_parts(shown | self._requested) | address_of(self.selected)
        if (name := self.name_of_selected) is not None:
            query["selection"] = name
        return query if self.orbit is None else {"orbit": str(self.orbit), **query}

    @property
    def _is_limited(self) -> bool:
        """Whether the options are those of a solution."""
        return self.param["field"].objects != [ALL]

    @property
    def selected(self) -> Subset:
        """The selected sources, exposures and detectors; the same object until it changes."""
        now = Subset(self.sources, self.exposures, self.detectors)
        self._selected = self._selected if now == self._selected else now
        return self._selected

    def select(self, selected: Subset) -> None:
        """Select sources, exposures and detectors in place of those selected before."""
        self.param.update(**selected.by_kind())

    def select_sources(self, sources: frozenset[int]) -> None:
        """Select sources by their ids, in place of those selected before."""
        self.sources = sources

    def select_exposures(self, exposures: frozenset[tuple[int, int]]) -> None:
        """Select exposures, (field_id, plate_id), in place of those selected before."""
        self.exposures = exposures

    def select_detectors(self, detectors: frozenset[int]) -> None:
        """Select detectors by their ids, in place of those selected before."""
        self.detectors = detectors

    @property
    def ids(self) -> SelectedIds:
        """What is selected as the marks of figures name it; all figures share it."""
        selected = self.selected
        if self._ids[0] is not selected:
            self._ids = (selected, ids_of(selected))
        return self._ids[1]

    @property
    def name_of_selected(self) -> str | None:
        """Name under which the selection is kept, None if it is not."""
        return next((name for name, kept in self.kept.items() if kept == self.selected), None)

    def _forget_requested(self, *events: param.parameterized.Event) -> None:
        """Let hold what a person chooses while an orbit is being loaded."""
        for event in events:
            self._requested.pop(event.name, None)

    def _restore_selected(self, address: Mapping[str, str]) -> list[str]:
        found = restored(address, self.large.find, self.kept)
        self.select(found.selected)
        if found.name:
            self.kept = {**self.kept, found.name: found.selected}
        return found.problems

    @property
    def detector_id(self) -> int | None:
        """The shown detector, None for all."""
        return None if self.detector == ALL else int(self.detector)

    def exposures_of(self, result: FitResult) -> list[tuple[int, int]]:
        """Return (field_id, plate_id) of the shown exposures of a solution."""
        table = result.exposures
        is_shown = table["plate_id"].between(*self.plates)
        if self.field != ALL:
            is_shown &= table["field_id"] == int(self.field)
        pairs = table.loc[is_shown, ["field_id", "plate_id"]]
        return [(int(f), int(p)) for f, p in pairs.itertuples(index=False)]
