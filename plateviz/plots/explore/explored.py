"""What *Explore* draws as a figure of a notebook or a report: checked, with its words."""

from collections.abc import Callable, Collection
from functools import partial
from typing import NamedTuple

from plateviz.figures.figure import Figure
from plateviz.plots.explore.explore import explored_figure
from plateviz.plots.explore.explored_rows import ExploredColumns
from plateviz.plots.explore.explored_text import require_columns, require_rows
from plateviz.tables.explore import ExplorableTable


class Explored(NamedTuple):
    """A figure of any column against any other.

    Attributes
    ----------
    title, caption : words about it
    plot : returns it; takes `theme` and other keywords of figures
    """

    title: str
    caption: str
    plot: Callable[..., Figure]


def explored(
    rows: str,
    chosen: ExploredColumns,
    known: Collection[str],
    table_of: Callable[[str], ExplorableTable],
) -> Explored:
    """Return the figure of what is chosen.

    Parameters
    ----------
    rows : what a row is, one of `known`
    table_of : returns the table of some rows

    Raises
    ------
    InputError
        If there are no such rows or columns.
    """
    require_rows(rows, known)
    table = table_of(rows)
    require_columns(chosen, rows, table.columns)
    caption = f"A row is one of the {rows}; with many rows in the frame, their number in cells."
    return Explored(
        f"{chosen.y} against {chosen.x}", caption, partial(explored_figure, table, chosen)
    )
