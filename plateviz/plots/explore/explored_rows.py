"""Rows of a table that a figure shows: how many, between which values, and where in its frame.

A table may have tens of millions of rows. They are looked at a part at a time: the arrays of a part
stay in the processor's cache, and none is made that is as long as the table.
"""

from collections.abc import Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from plateviz.figures.figure import Axis, Limits
from plateviz.plots.elements.cells import Counts
from plateviz.plots.explore.explored_names import names_in
from plateviz.tables.explore import ExplorableTable
from plateviz.tables.polygon import Polygon

# Rows of a part.
_PART = 2**18


@dataclass(frozen=True)
class ExploredColumns:
    """What is drawn against what.

    Attributes
    ----------
    x, y : names of columns
    colour : name of a column; empty for the class of the source, or for the number in each cell
    only : name of a column whose values between `lowest` and `highest` are drawn; empty for all
    is_log_x, is_log_y : whether the axes are logarithmic
    has_median : whether the median of y is drawn in bins of x
    limits : of x and y; None for those of the data
    selects : what an area selects: "sources", "exposures" or "detectors", if the rows are of them
    """

    x: str
    y: str
    colour: str = ""
    only: str = ""
    lowest: float = -np.inf
    highest: float = np.inf
    is_log_x: bool = False
    is_log_y: bool = False
    has_median: bool = False
    limits: tuple[Limits, Limits] | None = None
    selects: str = "sources"


class DataExtent(NamedTuple):
    """How many rows can be drawn, and their least and largest values.

    Attributes
    ----------
    n_shown : rows between the limits of `ExploredColumns.only`, with a value on both axes
    n_left_out : rows that are not between these limits
    x, y : of the drawn rows; NaN if there is none
    only : of all rows in the column that limits them; NaN if there is none
    """

    n_shown: int
    n_left_out: int
    x: Limits
    y: Limits
    only: Limits


class _Part(NamedTuple):
    """Some rows: their numbers, their places, and which can be drawn."""

    rows: slice
    x: np.ndarray
    y: np.ndarray
    is_kept: np.ndarray | None
    is_drawable: np.ndarray


def kept_rows(table: ExplorableTable, chosen: ExploredColumns) -> np.ndarray:
    """Return whether each row is between the limits of the column that limits them."""
    if not chosen.only:
        return np.ones(table.size, dtype=bool)
    values = table.numbers(chosen.only)
    return (values >= chosen.lowest) & (values <= chosen.highest)


def extent_of(table: ExplorableTable, chosen: ExploredColumns) -> DataExtent:
    """Return how many rows can be drawn, and between which values they lie."""
    n_shown = n_left_out = 0
    x, y, only = _Span(), _Span(), _Span()
    limiting = table.numbers(chosen.only) if chosen.only else None
    for part in _parts(table, chosen):
        n_shown += int(np.count_nonzero(part.is_drawable))
        x.extend(part.x, part.is_drawable)
        y.extend(part.y, part.is_drawable)
        if limiting is not None and part.is_kept is not None:
            values = limiting[part.rows]
            only.extend(values, np.isfinite(values))
            n_left_out += int(np.count_nonzero(~part.is_kept))
    return DataExtent(n_shown, n_left_out, x.limits, y.limits, only.limits)


def counts_in_frame(table: ExplorableTable, chosen: ExploredColumns, x: Axis, y: Axis) -> Counts:
    """Return the rows in each cell of a frame; two threads count, of many rows half each."""
    colours = table.numbers(chosen.colour) if chosen.colour else None
    names = names_in(table, chosen.colour)
    has_means = colours is not None and names is None

    def count(rows: range) -> Counts:
        counts = Counts(x, y, has_medians=chosen.has_median, has_values=has_means, names=names)
        for part in _parts(table, chosen, rows):
            is_kept = None if part.is_drawable.all() else part.is_drawable
            counts.add(part.x, part.y, is_kept, None if colours is None else colours[part.rows])
        return counts

    middle = table.size // 2 // _PART * _PART
    # Held, so that both threads find what has been read.
    _read = [table.numbers(name) for name in (chosen.x, chosen.y, chosen.only) if name]
    with ThreadPoolExecutor(1) as helper:
        later = helper.submit(count, range(middle, table.size))
        counts = count(range(middle))
        counts.merge(later.result())
    return counts


def rows_in_frame(
    table: ExplorableTable,
    chosen: ExploredColumns,
    limits: tuple[Limits, Limits] | None,
    selected: Collection[Any] | None = None,
) -> np.ndarray:
    """Return the numbers of the rows that can be drawn.

    Parameters
    ----------
    limits : of x and y, between which the rows lie; None for all
    selected : items of what the columns select, of which the rows are; None for all
    """
    items = None if selected is None else table.items(table.kind(chosen.selects))
    among = None if items is None or selected is None else items.among(selected)
    found = [np.zeros(0, dtype=np.int64)]
    for part in _parts(table, chosen):
        wanted = part.is_drawable
        if limits is not None:
            for values, ends in zip((part.x, part.y), limits, strict=True):
                low, high = sorted(ends)
                wanted &= (values >= low) & (values <= high)
        if items is not None and among is not None:
            wanted &= among[items.codes[part.rows]]
        found.append(np.flatnonzero(wanted) + part.rows.start)
    return np.concatenate(found)


def items_within(
    table: ExplorableTable, chosen: ExploredColumns, corners: np.ndarray
) -> frozenset[Any]:
    """Return the sources, exposures or detectors with a drawn row inside a polygon.

    Parameters
    ----------
    table : of rows that are of something
    chosen : the columns of the polygon's coordinates, the limits of the rows, and what is selected
    corners : of the polygon, which closes itself, (n, 2)
    """
    polygon, items = Polygon(corners), table.items(table.kind(chosen.selects))
    is_found = np.zeros(len(items.items), dtype=bool)
    for part in _parts(table, chosen):
        is_inside = part.is_drawable & polygon.contains(part.x, part.y)
        is_found[items.codes[part.rows][is_inside]] = True
    return frozenset(items.items[n] for n in np.flatnonzero(is_found))


def _parts(
    table: ExplorableTable, chosen: ExploredColumns, among_rows: range | None = None
) -> Iterator[_Part]:
    """Yield all rows, or some, a part at a time; a part is valid until the next one."""
    x, y = table.numbers(chosen.x), table.numbers(chosen.y)
    limiting = table.numbers(chosen.only) if chosen.only else None
    # New arrays would take longer to get from the system than to fill.
    drawable, other, kept = np.empty((3, min(_PART, table.size)), dtype=bool)
    all_rows = range(table.size) if among_rows is None else among_rows
    for start in all_rows[::_PART]:
        rows = slice(start, min(start + _PART, all_rows.stop))
        among = slice(0, rows.stop - rows.start)
        is_drawable = _drawable(x[rows], chosen.is_log_x, drawable[among])
        is_drawable &= _drawable(y[rows], chosen.is_log_y, other[among])
        is_kept = None
        if limiting is not None:
            values = limiting[rows]
            is_kept = np.greater_equal(values, chosen.lowest, out=kept[among])
            is_kept &= np.less_equal(values, chosen.highest, out=other[among])
            is_drawable &= is_kept
        yield _Part(rows, x[rows], y[rows], is_kept, is_drawable)


def _drawable(values: np.ndarray, is_log: bool, found: np.ndarray) -> np.ndarray:
    np.isfinite(values, out=found)
    if is_log:
        found &= values > 0
    return found


class _Span:
    """Least and largest of the values seen so far."""

    def __init__(self) -> None:
        self._low, self._high = np.inf, -np.inf
        self._bounds, self._values = np.empty((2, 0))

    def extend(self, values: np.ndarray, counts: np.ndarray) -> None:
        """Take the values that count."""
        if counts.all():
            self._take(values, values)
            return
        if len(self._values) < len(values):
            self._bounds, self._values = np.empty((2, len(values)), values.dtype)
        bounds, found = self._bounds[: len(values)], self._values[: len(values)]
        # Arithmetic: to choose some of the values takes five times as long.
        outside = np.array([np.inf, -np.inf], values.dtype)
        np.take(outside, counts.view(np.uint8), out=bounds, mode="clip")
        self._take(np.fmax(values, bounds, out=found), None)
        np.negative(bounds, out=bounds)
        self._take(None, np.fmin(values, bounds, out=found))

    def _take(self, low: np.ndarray | None, high: np.ndarray | None) -> None:
        if low is not None:
            self._low = min(self._low, float(low.min(initial=np.inf)))
        if high is not None:
            self._high = max(self._high, float(high.max(initial=-np.inf)))

    @property
    def limits(self) -> Limits:
        return (self._low, self._high) if self._low <= self._high else (np.nan, np.nan)
