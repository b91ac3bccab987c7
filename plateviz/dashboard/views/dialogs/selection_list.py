"""SelectionList: a dialog with a row per selected source, exposure and detector."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import pandas as pd
import panel as pn

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.views.dialogs.dialog import dialog
from plateviz.dashboard.views.elements.markup import heading
from plateviz.dashboard.views.elements.table import DataTable
from plateviz.tables import selected_detectors, selected_exposures, selected_sources
from plateviz.tables.headings import (
    SELECTED_DETECTORS,
    SELECTED_EXPOSURES,
    SELECTED_SOURCES,
    Heading,
)
from solver.errors import InputError

_PAGE_SIZE = 15
_NOTHING = "Nothing is selected. A tap, box or lasso in a figure selects what its points are of."


class _Part(NamedTuple):
    """Title and columns of the table of a kind."""

    title: str
    headings: Mapping[str, Heading]


_PARTS = {
    "sources": _Part("Sources", SELECTED_SOURCES),
    "exposures": _Part("Exposures", SELECTED_EXPOSURES),
    "detectors": _Part("Detectors", SELECTED_DETECTORS),
}


class SelectionList(pn.viewable.Viewer):
    """What is selected, with its values in the solution on the screen, or in the run."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the session of `navigation`; the list is filled when it is opened."""
        super().__init__(**params)
        self._navigation = navigation
        self._tables: dict[str, DataTable] = {}
        self._dialog = dialog("Selection", width="lg")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the dialog."""
        return self._dialog

    def open(self) -> None:
        """Open the dialog with new tables.

        The browser drops the tables of a dialog that is closed, and reports an error where one that
        it is still making gets other rows.
        """
        self._make()
        self._dialog.open = True

    def show(self) -> None:
        """Show what is selected now, if the dialog is open."""
        if not self._dialog.open:
            return
        if [*self._tables] == self._navigation.session.selection.selected.kinds:
            self._fill()
        else:
            self._make()

    def _make(self) -> None:
        kinds = self._navigation.session.selection.selected.kinds
        self._tables = {kind: self._table(kind) for kind in kinds}
        self._fill()
        parts = [
            part
            for kind, table in self._tables.items()
            for part in (heading(self._title(kind)), table)
        ]
        self._dialog[:] = parts or [heading(_NOTHING)]

    def _title(self, kind: str) -> str:
        title = _PARTS[kind].title
        return f"{title} (a click opens the motion of one)" if self._opens(kind) else title

    def _opens(self, kind: str) -> bool:
        return kind == "sources" and self._navigation.run is not None

    def _table(self, kind: str) -> DataTable:
        on_row: Callable[[pd.Series], object] | None = (
            self._open_source if self._opens(kind) else None
        )
        units = self._navigation.session.units
        return DataTable(_PARTS[kind].headings, on_row, page_size=_PAGE_SIZE, units=units)

    def _fill(self) -> None:
        session = self._navigation.session
        for kind, table in self._tables.items():
            table.show(self._rows(kind), session.theme)

    def _rows(self, kind: str) -> pd.DataFrame:
        session, run = self._navigation.session, self._navigation.run
        result = session.shown.result if session.shown else None
        if kind == "exposures":
            return selected_exposures(session.selection.exposures, result)
        if kind == "detectors":
            return selected_detectors(session.selection.detectors, result)
        try:
            counts = run.counts() if run is not None else None
        except InputError:
            # The run is gone; the values of the orbit on the screen are not.
            counts = None
        return selected_sources(session.selection.sources, result, counts)

    def _open_source(self, row: pd.Series) -> None:
        self._dialog.open = False
        self._navigation.open_source(str(row["id"]))
