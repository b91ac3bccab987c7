"""SourceList: a window with a row per selected source."""

import pandas as pd
import panel as pn

from plateviz.dashboard.navigation import Navigation
from plateviz.dashboard.views.table import DataTable
from plateviz.dashboard.views.window import window
from plateviz.tables import selected_sources
from plateviz.tables.headings import SELECTED_SOURCES

_PAGE_SIZE = 15


class SourceList(pn.viewable.Viewer):
    """The selected sources with their values in the solution on the screen, or in the run."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the session of `navigation`; the list is filled when it is opened."""
        super().__init__(**params)
        self._navigation = navigation
        self._table: DataTable | None = None
        self._window = window("Selected sources", width="lg")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the window."""
        return self._window

    def open(self) -> None:
        """Open the window with a new table.

        The browser drops the table of a window that is closed, and reports an error where one that
        it is still making gets other rows.
        """
        on_row = self._open_source if self._navigation.run else None
        self._table = DataTable(SELECTED_SOURCES, on_row, page_size=_PAGE_SIZE)
        self._fill(self._table)
        self._window[:] = [self._table]
        self._window.open = True

    def show(self) -> None:
        """Show the sources that are selected now, if the window is open."""
        if self._table is not None and self._window.open:
            self._fill(self._table)

    def _fill(self, table: DataTable) -> None:
        session = self._navigation.session
        result = session.shown.result if session.shown else None
        run = self._navigation.run
        counts = run.counts() if run is not None else None
        rows = selected_sources(session.selection.sources, result, counts)
        table.show(rows, session.theme)

    def _open_source(self, row: pd.Series) -> None:
        self._window.open = False
        self._navigation.open_source(str(row["id"]))
