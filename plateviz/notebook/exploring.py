"""Explores: any column of the tables of a solution or a run against any other, as a figure."""

import math
from abc import ABC, abstractmethod
from collections.abc import Collection
from typing import TYPE_CHECKING

from plateviz.notebook.figures import FigureSpec, NotebookFigure, figure_collection
from solver.errors import InputError

if TYPE_CHECKING:
    from plateviz.tables.explore import ExplorableTable

Range = tuple[float | None, float | None]
"""Least and largest value; None for no limit."""


class Explores(ABC):
    """An object whose rows can be drawn, any column against any other."""

    def explore(
        self,
        rows: str,
        x: str,
        y: str,
        *,
        colour: str = "",
        only: str = "",
        between: Range = (None, None),
        log_x: bool = False,
        log_y: bool = False,
        median: bool = False,
        zoom: tuple[tuple[float, float], tuple[float, float]] | None = None,
        theme: str = "light",
    ) -> NotebookFigure:
        """Return the figure that *Explore* draws on the dashboard.

        Parameters
        ----------
        rows : what a row is, such as "measurements" of a solution or of a run
        x, y : names of columns
        colour : column that decides the colour; the class of the source or the number by default
        only : column whose values `between` two limits are drawn; all by default
        log_x, log_y : whether the axes are logarithmic
        median : whether medians of y in bins of x are drawn
        zoom : limits of x and of y; those of the data by default
        theme : "light" or "dark"

        Raises
        ------
        InputError
            If there are no such rows, columns or theme, the limits are no numbers in order, or
            files of the run cannot be read.
        """
        from plateviz.plots.explore.explored import explored
        from plateviz.plots.explore.explored_rows import ExploredColumns

        lowest, highest = _limits(between)
        chosen = ExploredColumns(x, y, colour, only, lowest, highest, log_x, log_y, median, zoom)
        found = explored(rows, chosen, self._explorable_rows(), self._explorable)
        spec = FigureSpec("explore", *found)
        return figure_collection([spec], theme)["explore"]

    @abstractmethod
    def _explorable_rows(self) -> Collection[str]:
        """Return what a row can be."""

    @abstractmethod
    def _explorable(self, rows: str) -> "ExplorableTable":
        """Return the table of some rows."""


def _limits(between: Range) -> tuple[float, float]:
    """Return the limits, which may be infinite."""
    try:
        low, high = between
        least = -math.inf if low is None else float(low)
        most = math.inf if high is None else float(high)
    except (TypeError, ValueError) as error:
        raise InputError(f"between: expected two numbers or None, found {between!r}") from error
    if not least <= most:
        raise InputError(f"between: expected the lower limit first, found {between!r}")
    return least, most
