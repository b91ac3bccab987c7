"""Parts of axes that are equal on the screen: edges of bins, and cells with numbers of points."""

import numpy as np

from plateviz.figures.figure import Axis, Glyphs, Ramp
from plateviz.figures.glyphs import image

# Columns and rows of cells.
_SHAPE = (320, 200)


def scaled(values: np.ndarray, is_log: bool) -> np.ndarray:
    """Return values in units of an axis: their logarithms if it is logarithmic."""
    return np.log10(values) if is_log else values


def unscaled(values: np.ndarray, is_log: bool) -> np.ndarray:
    """Return the values that `scaled` was given."""
    return 10.0**values if is_log else values


def edges_of(axis: Axis, count: int) -> np.ndarray:
    """Return `count` + 1 ascending edges that divide an axis into equal parts on the screen."""
    low, high = scaled(np.array(sorted(axis.limits)), axis.is_log)
    return unscaled(np.linspace(low, high, count + 1), axis.is_log)


def counts_in_cells(x: np.ndarray, y: np.ndarray, x_axis: Axis, y_axis: Axis) -> np.ndarray:
    """Return the number of points in each cell between the limits; NaN where there is none.

    Returns
    -------
    (rows, columns), the first row at the lower end of `y_axis`
    """
    cell, _ = _numbered(x, y, x_axis, y_axis)
    counts = np.bincount(cell, minlength=_SHAPE[0] * _SHAPE[1]).astype(float)
    counts[counts == 0] = np.nan
    return counts.reshape(_SHAPE[::-1])


def means_in_cells(
    x: np.ndarray, y: np.ndarray, values: np.ndarray, x_axis: Axis, y_axis: Axis
) -> np.ndarray:
    """Return the mean value in each cell, as `counts_in_cells`; missing values do not count."""
    has_value = np.isfinite(values)
    x, y, values = x[has_value], y[has_value], values[has_value]
    cell, is_inside = _numbered(x, y, x_axis, y_axis)
    sums = np.bincount(cell, values[is_inside], minlength=_SHAPE[0] * _SHAPE[1])
    return sums.reshape(_SHAPE[::-1]) / counts_in_cells(x, y, x_axis, y_axis)


def cells(values: np.ndarray, x_axis: Axis, y_axis: Axis, *, name: str, ramp: Ramp) -> Glyphs:
    """Return the values of cells as an image between the limits of the axes."""
    (x0, x1), (y0, y1) = sorted(x_axis.limits), sorted(y_axis.limits)
    return image(values, (x0, x1), (y0, y1), name=name, ramp=ramp)


def _numbered(
    x: np.ndarray, y: np.ndarray, x_axis: Axis, y_axis: Axis
) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of the cell of each point inside, and which points are inside."""
    places, is_inside = [], np.ones(len(x), dtype=bool)
    for values, axis, count in ((x, x_axis, _SHAPE[0]), (y, y_axis, _SHAPE[1])):
        low, high = scaled(np.array(sorted(axis.limits)), axis.is_log)
        place = (scaled(values, axis.is_log) - low) * (count / (high - low))
        is_inside &= (place >= 0) & (place < count)
        places.append(place)
    column, row = (place[is_inside].astype(np.int64) for place in places)
    return row * _SHAPE[0] + column, is_inside
