"""Polygon: which of many places are inside an area that a hand has drawn."""

import numpy as np

# Cells along each side of the polygon's box.
_CELLS = 128
_OUTSIDE, _INSIDE, _EDGE = 0, 1, 2


class Polygon:
    """An area between straight edges.

    Of millions of places, only those near an edge are compared with the edges: the others share
    the answer of the cell of a grid that they lie in.
    """

    def __init__(self, corners: np.ndarray) -> None:
        """Close the polygon of `corners`, (n, 2); with fewer than three it contains nothing."""
        self._corners = corners
        self._is_area = len(corners) >= 3
        if self._is_area:
            self._low = corners.min(axis=0)
            self._side = corners.max(axis=0) - self._low
            self._is_area = bool(np.all(self._side > 0))
        if self._is_area:
            self._cells = self._classified()

    def contains(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return whether each place is inside; a place that is no number is not."""
        if not self._is_area:
            return np.zeros(len(x), dtype=bool)
        kinds = self._cells[self._number(y, 1), self._number(x, 0)]
        is_inside = kinds == _INSIDE
        on_edge = np.flatnonzero(kinds == _EDGE)
        places = np.stack([x[on_edge], y[on_edge]], axis=1)
        is_inside[on_edge] = _is_inside(places, self._corners)
        return is_inside

    def _number(self, values: np.ndarray, axis: int) -> np.ndarray:
        """Return in which cell along an axis values are, from 1; 0 or one more outside."""
        place = (values - float(self._low[axis])) * float(_CELLS / self._side[axis]) + 1.0
        # `fmax` takes the number of a number and a NaN.
        return np.fmin(np.fmax(place, 0.0), _CELLS + 1.0).astype(np.int32)

    def _classified(self) -> np.ndarray:
        """Return whether each cell is inside, outside or near an edge, (row, column).

        A margin of one cell is outside.
        """
        steps = (np.arange(_CELLS) + 0.5) / _CELLS
        middles = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        is_inside = _is_inside(self._low + self._side * middles, self._corners)
        kinds = np.where(is_inside, _INSIDE, _OUTSIDE).reshape(_CELLS, _CELLS)
        # Places on the edges half a cell apart; the edges pass through their cells and the
        # neighbours of these.
        along = np.linspace(0.0, 1.0, 2 * _CELLS + 1)[:, None, None]
        ends = (self._corners - self._low) / self._side * _CELLS
        on_edges = (ends + along * (np.roll(ends, -1, axis=0) - ends)).reshape(-1, 2)
        column, row = np.clip(on_edges.astype(int), 0, _CELLS - 1).T
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                beside = np.clip([row + down, column + right], 0, _CELLS - 1)
                kinds[tuple(beside)] = _EDGE
        return np.pad(kinds, 1, constant_values=_OUTSIDE)


def _is_inside(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return whether each place is inside a polygon: a ray from it crosses the edge oddly often."""
    is_inside = np.zeros(len(places), dtype=bool)
    x, y = places.T
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        crosses = (y0 > y) != (y1 > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            is_inside ^= crosses & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
    return is_inside
