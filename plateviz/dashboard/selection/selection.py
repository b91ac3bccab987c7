"""Selection: the sources, exposures and detectors that are selected in one browser session."""

from collections.abc import Mapping
from typing import Any

import param

from plateviz.dashboard.selection.large_selections import LargeSelections
from plateviz.dashboard.selection.selected import NO_IDS, SelectedIds, address_of, ids_of
from plateviz.dashboard.selection.selection_address import restored
from solver.data.subset import KINDS, NOTHING, Subset


class Selection(param.Parameterized):
    """What is selected in every view of the session.

    Figures let it stand out among what is shown, and it can be left out of the fit. All is selected
    by id, and stays selected in an orbit that has not measured it.
    """

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
        """Begin with nothing selected.

        Parameters
        ----------
        large : of the server; None for those of this session alone
        """
        super().__init__(**values)
        self._selected = NOTHING
        self._ids: tuple[Subset, SelectedIds] = (NOTHING, NO_IDS)
        self.large = large or LargeSelections()
        self.param.watch(lambda *_: self.large.remember(self.selected), [*KINDS])

    def restore(self, address: Mapping[str, str]) -> list[str]:
        """Select what a page's address requests; ignore invalid values.

        Parameters
        ----------
        address : query of the address, as from `address`; other keys are ignored

        Returns
        -------
        The invalid values, in words.
        """
        found = restored(address, self.large.find, self.kept)
        self.select(found.selected)
        if found.name:
            self.kept = {**self.kept, found.name: found.selected}
        return found.problems

    def address(self) -> dict[str, str]:
        """Return the selection as the query of the page's address; `restore` reads it back."""
        query = address_of(self.selected)
        if (name := self.name_of_selected) is not None:
            query["selection"] = name
        return query

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
