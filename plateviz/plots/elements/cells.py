"""Parts of axes that are equal on the screen: bins, and cells with numbers of points."""

from typing import NamedTuple

import numpy as np

from plateviz.figures.figure import Axis, Glyphs, Ramp, Tooltips
from plateviz.figures.glyphs import image

# Columns and rows of cells; both are whole numbers of the bins of histograms and of medians.
_SHAPE = (320, 200)
_BINS = (64, 50)
# Bins of x with a median of y each, parts of a cell that it is found to, and points that a bin
# needs.
_MEDIANS, _FINER, _LEAST_IN_BIN = 32, 10, 8
_SHARES = (0.16, 0.5, 0.84)
# Upper ends of the parts in which medians are found, as shares of the y axis. What is below the
# frame counts at its lower end, what is above at its upper end.
_ENDS = np.append(np.arange(_SHAPE[1] * _FINER + 1) / (_SHAPE[1] * _FINER), 1.0)


class Medians(NamedTuple):
    """Medians of y in bins of x, in the units of the axes.

    Attributes
    ----------
    x : middles of the bins with enough points, the median of which is in the frame
    low, median, high : quantiles of y; `low` and `high` outside the frame are at its edge
    """

    x: np.ndarray
    low: np.ndarray
    median: np.ndarray
    high: np.ndarray


class Counts:
    """Numbers of points in the cells of a frame, of all points that were added."""

    def __init__(
        self,
        x: Axis,
        y: Axis,
        *,
        has_medians: bool = False,
        has_values: bool = False,
        names: np.ndarray | None = None,
    ) -> None:
        """Begin without points.

        Parameters
        ----------
        x, y : axes of the frame
        has_medians : whether medians of y are asked for afterwards
        has_values : whether points have values, whose means are asked for afterwards
        names : values of all points, ascending, the most frequent of which is asked for
            afterwards; None for values that have a mean
        """
        self._axes = x, y
        self._cell = np.empty(0, np.intp)
        # One more cell at each end, for what is outside the frame.
        self._counts = np.zeros((_SHAPE[1] + 2, _SHAPE[0] + 2), dtype=np.int64)
        self._sums = np.zeros(self._counts.shape) if has_values else None
        self._with_value = np.zeros_like(self._counts) if has_values else None
        self.names = names
        shape = (*self._counts.shape, 0 if names is None else len(names))
        self._by_name = np.zeros(shape, dtype=np.int32)
        fine = (_SHAPE[1] * _FINER + 2, _MEDIANS + 2)
        self._fine = np.zeros(fine, dtype=np.int64) if has_medians else None
        self._make_room(1, np.dtype(float))

    def add(
        self,
        x: np.ndarray,
        y: np.ndarray,
        is_kept: np.ndarray | None = None,
        values: np.ndarray | None = None,
    ) -> None:
        """Count points.

        Parameters
        ----------
        x, y : places
        is_kept : whether a point counts; None for all, which have numbers on the axes then
        values : of the points; missing ones do not count in a mean
        """
        finer = 1 if self._fine is None else _FINER
        self._make_room(len(x), np.result_type(x, y))
        column, row = (part[: len(x)] for part in self._numbers)
        self._number(x, self._axes[0], _SHAPE[0], column)
        self._number(y, self._axes[1], _SHAPE[1] * finer, row)
        if is_kept is not None:
            # The first cell is outside the frame.
            column *= is_kept
            row *= is_kept
        if self._fine is not None:
            self._count(row, _coarser(column, _SHAPE[0] // _MEDIANS), self._fine)
            row = _coarser(row, _FINER)
        self._count(row, column, self._counts)
        if self.names is not None and values is not None:
            # The last count has left the cells of the points.
            cell = self._cell[: len(values)]
            cell *= len(self.names)
            cell += np.searchsorted(self.names, values)
            found = np.bincount(cell, minlength=self._by_name.size)
            self._by_name += found.reshape(self._by_name.shape).astype(np.int32)
        elif self._sums is not None and self._with_value is not None and values is not None:
            has_value = np.isfinite(values)
            row *= has_value
            column *= has_value
            self._count(row, column, self._with_value)
            self._count(row, column, self._sums, np.where(has_value, values, 0.0))

    def merge(self, other: "Counts") -> None:
        """Add the points that another one of the same frame has counted."""
        self._counts += other._counts
        self._by_name += other._by_name
        for own, added in (
            (self._fine, other._fine),
            (self._sums, other._sums),
            (self._with_value, other._with_value),
        ):
            if own is not None and added is not None:
                own += added

    @property
    def number(self) -> int:
        """Number of points inside the frame."""
        return int(self._inside(self._counts).sum())

    def image(self) -> np.ndarray:
        """Return the number in each cell, the lowest row first; NaN where there is none."""
        found = self._inside(self._counts).astype(np.float32)
        found[found == 0] = np.nan
        return found

    def means(self) -> np.ndarray:
        """Return the mean value in each cell, as `image`."""
        if self._sums is None or self._with_value is None:
            raise ValueError("expected points with values, found none")
        n = self._inside(self._with_value).astype(float)
        n[n == 0] = np.nan
        return (self._inside(self._sums) / n).astype(np.float32)

    def most_frequent(self) -> np.ndarray:
        """Return the most frequent value in each cell, the least of several; as `image`."""
        if self.names is None:
            raise ValueError("expected points with names, found others")
        found = self.names[self._inside(self._by_name).argmax(axis=2)].astype(np.float32)
        found[self._inside(self._counts) == 0] = np.nan
        return found

    def histogram(self, axis: int) -> tuple[np.ndarray, np.ndarray]:
        """Return edges and numbers of bins along an axis, 0 for x and 1 for y."""
        along = self._inside(self._counts).sum(axis=axis)
        n = along.reshape(_BINS[axis], -1).sum(axis=1)
        return edges_of(self._axes[axis], _BINS[axis]), n

    def medians(self) -> Medians:
        """Return the median of y in bins of x, with the range of two thirds of the points.

        Points above and below the frame count, those to its sides do not.
        """
        if self._fine is None:
            raise ValueError("expected points counted for medians, found others")
        fine = self._fine[:, 1:-1]
        bins = np.flatnonzero(fine.sum(axis=0) >= _LEAST_IN_BIN)
        below = [np.cumsum(fine[:, one]) / fine[:, one].sum() for one in bins]
        shares = np.array([np.interp(_SHARES, n, _ENDS) for n in below]).reshape(-1, 3)
        is_inside = (shares[:, 1] > 0.0) & (shares[:, 1] < 1.0)
        x = _at(self._axes[0], (bins[is_inside] + 0.5) / _MEDIANS)
        return Medians(x, *_at(self._axes[1], shares[is_inside].T))

    def _make_room(self, size: int, kind: np.dtype) -> None:
        """Have arrays for so many points.

        New arrays would take longer to get from the system than to fill.
        """
        if len(self._cell) < size or self._place.dtype != kind:
            self._place, self._cell = np.empty(size, kind), np.empty(size, np.intp)
            self._numbers = np.empty((2, size), np.int32)

    def _number(self, values: np.ndarray, axis: Axis, count: int, found: np.ndarray) -> None:
        """Find in which of `count` parts of an axis values are, from 1; 0 or one more outside.

        A value that is no number gets any integer.
        """
        place = self._place[: len(values)]
        ends = np.array(sorted(axis.limits))
        with np.errstate(divide="ignore", invalid="ignore"):
            if axis.is_log:
                # Natural logarithms take a fifth of the time of others.
                ends, values = np.log(ends), np.log(values, out=place)
            low, high = map(float, ends)
            np.subtract(values, low, out=place)
            place *= count / (high - low)
            place += 1.0
            np.clip(place, 0.0, count + 1.0, out=place)
            np.copyto(found, place, casting="unsafe")

    def _count(
        self,
        row: np.ndarray,
        column: np.ndarray,
        cells: np.ndarray,
        weights: np.ndarray | None = None,
    ) -> None:
        """Add points to the numbers in `cells`, or their weights to the sums there."""
        cell = self._cell[: len(row)]
        np.multiply(row, cells.shape[1], out=cell)
        cell += column
        cells += np.bincount(cell, weights, minlength=cells.size).reshape(cells.shape)

    def _inside(self, cells: np.ndarray) -> np.ndarray:
        return cells[1:-1, 1:-1]


def scaled(values: np.ndarray, is_log: bool) -> np.ndarray:
    """Return values in units of an axis: their logarithms if it is logarithmic."""
    if not is_log:
        return values
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.log10(values)


def unscaled(values: np.ndarray, is_log: bool) -> np.ndarray:
    """Return the values that `scaled` was given."""
    return 10.0**values if is_log else values


def edges_of(axis: Axis, count: int) -> np.ndarray:
    """Return `count` + 1 ascending edges that divide an axis into equal parts on the screen."""
    return _at(axis, np.linspace(0.0, 1.0, count + 1))


def cells(
    values: np.ndarray,
    x_axis: Axis,
    y_axis: Axis,
    *,
    name: str,
    ramp: Ramp,
    hover: Tooltips = (),
) -> Glyphs:
    """Return the values of cells as an image between the limits of the axes."""
    (x0, x1), (y0, y1) = sorted(x_axis.limits), sorted(y_axis.limits)
    return image(values, (x0, x1), (y0, y1), name=name, ramp=ramp, hover=hover)


def _at(axis: Axis, share: np.ndarray) -> np.ndarray:
    """Return the values at shares of the length of an axis."""
    low, high = scaled(np.array(sorted(axis.limits)), axis.is_log)
    return unscaled(low + share * (high - low), axis.is_log)


def _coarser(numbers: np.ndarray, factor: int) -> np.ndarray:
    """Return in which part a point is, where a part is as large as `factor` of those given."""
    return (numbers - 1) // factor + 1
