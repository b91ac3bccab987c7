"""RowsToExplore: what the Explore workspaces draw, of a solution of an orbit and of a run."""

from collections.abc import Callable, Hashable
from concurrent.futures import Executor
from functools import partial
from typing import NamedTuple, Protocol

from plateviz.dashboard.navigation.exploration import Exploration
from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.runs.explorable import COLUMNS_OF_RUN, MOST_ROWS, explorable_of_run
from plateviz.tables.explore import EXPLORABLE, ExplorableTable

_COMMON = (
    "The columns that the controls name, one point per row; above 20,000 rows in the frame, the "
    "number of rows in each cell, or the mean of the column that gives the colour. Along both axes "
    "the histograms of what is in the frame. A drag selects what the controls "
    "name, which all other figures show. The wheel zooms, and the cells become finer."
)
_OF_RUN = (
    f" Only the columns that are drawn are read. Above {MOST_ROWS:,} measurements, those of one "
    "orbit in two, or in more, are shown. For a survey a hundred times as large, numbers in cells "
    "would be made when its run is gathered, and one level of detail read at a time."
)


class TableRequest(NamedTuple):
    """A table that can be drawn.

    Attributes
    ----------
    columns : names of its columns
    key : differs for another table, or other contents of it
    make : makes it; may take a while, and raises InputError
    """

    columns: list[str]
    key: Hashable
    make: Callable[[], ExplorableTable]


class RowsToExplore(Protocol):
    """Rows of a solution or of a run, in tables of which a person chooses the columns.

    Attributes
    ----------
    exploration : what is drawn of them
    caption : what the figure says of itself
    document : where the documents say more of it
    executor : what makes tables and figures; None if they take no time
    """

    exploration: Exploration
    caption: str
    document: str
    executor: Executor | None

    def request(self) -> TableRequest | None:
        """Return the table of `exploration`, or None while there is none."""
        ...

    def subject(self) -> str:
        """Return what the rows are of, as in names of files."""
        ...


class OrbitRows:
    """The rows of the solution on the screen."""

    caption = _COMMON
    document = "assets/docs/diagnostics.md, “Reading the page”"
    executor: Executor | None = None

    def __init__(self, navigation: Navigation) -> None:
        """Follow the session of `navigation`."""
        self.exploration, self._session = navigation.exploration, navigation.session
        self._known: tuple[object, str, TableRequest] | None = None
        self._made = 0

    def request(self) -> TableRequest | None:
        """Return the table of `exploration`, or None while there is no solution."""
        shown, name = self._session.shown, self.exploration.table
        if shown is None:
            return None
        known = self._known
        if known is None or known[0] is not shown.result or known[1] != name:
            table, self._made = EXPLORABLE[name](shown.result), self._made + 1
            request = TableRequest(list(table.columns), self._made, lambda: table)
            self._known = known = (shown.result, name, request)
        return known[2]

    def subject(self) -> str:
        """Return the orbit on the screen."""
        return self._session.shown_part.subject()


class RunRows:
    """The rows of the run on the screen, which are read by another thread."""

    caption = _COMMON + _OF_RUN
    document = "assets/docs/survey-diagnostics.md, “Explore all measurements”"

    def __init__(self, navigation: Navigation) -> None:
        """Follow `navigation`."""
        self.exploration, self._navigation = navigation.survey_exploration, navigation
        store = navigation.session.store
        self.executor: Executor | None = store.background
        self._columns = store.columns
        self._made: tuple[Hashable, ExplorableTable] | None = None

    def request(self) -> TableRequest | None:
        """Return the table of `exploration`, or None while there is no run."""
        run, name = self._navigation.run, self.exploration.table
        if run is None:
            return None
        key = (run.name, self._navigation.run_progress, self.exploration.returns, name)
        make = partial(explorable_of_run, run, name, self._columns)
        return TableRequest(list(COLUMNS_OF_RUN[name]), key, partial(self._once, key, make))

    def subject(self) -> str:
        """Return the run on the screen."""
        return f"run-{self._navigation.run_name}"

    def _once(self, key: Hashable, make: Callable[[], ExplorableTable]) -> ExplorableTable:
        """Make a table unless it is the last one that was made."""
        made = self._made
        if made is None or made[0] != key:
            self._made = made = (key, make())
        return made[1]
