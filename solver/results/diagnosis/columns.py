"""The patterns, and what is fitted, as columns: their values at some measurements.

The uncertainties are taken to be the same along both axes, so that a function that displaces along
x by one parameter and along y by another is evaluated, and summed, only once.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from solver.results.diagnosis.modelled import Column, Scalar, Vector
from solver.results.diagnosis.patterns import Patterns, cell_of, legendre_at
from solver.results.diagnosis.rows import Rows


class Columns(NamedTuple):
    """Displacements of n rows: first those along x, then the same along y, then those along both.

    Attributes
    ----------
    values : the displacement of those along x, and of those along y; then of the others, all along
        x and after that all along y; shape (n, scalars + 2 vectors)
    n_scalars : number of those along x
    """

    values: np.ndarray
    n_scalars: int

    @property
    def n_vectors(self) -> int:
        """The number of those along both axes."""
        return (self.values.shape[1] - self.n_scalars) // 2

    @property
    def count(self) -> int:
        """The number of columns."""
        return 2 * self.n_scalars + self.n_vectors

    @property
    def parts(self) -> list[np.ndarray]:
        """The scalars, and x and y of the vectors, each of shape (n, number)."""
        return np.split(self.values, [self.n_scalars, self.n_scalars + self.n_vectors], axis=1)

    def from_axes(self, along_x: np.ndarray, along_y: np.ndarray) -> np.ndarray:
        """Return sums over all columns from sums over the `values` along x, and along y.

        Shape (sums, count), from two of (sums, scalars + 2 vectors).
        """
        n, end = self.n_scalars, self.n_scalars + self.n_vectors
        both = along_x[:, n:end] + along_y[:, end:]
        return np.concatenate([along_x[:, :n], along_y[:, :n], both], axis=1)

    def gram(self) -> np.ndarray:
        """Return the products of all columns with each other, shape (count, count)."""
        return self.products(self.values.T @ self.values)

    def products(self, same: np.ndarray, crossed: np.ndarray | None = None) -> np.ndarray:
        """Return the products of all columns from those of the `values`, shape (count, count).

        Parameters
        ----------
        same : products of values along the same axis, shape (scalars + 2 vectors,) twice
        crossed : of values along x, the rows, with others along y; opposite in sign for those
            along y with others along x. None if there are none, as on the focal plane
        """
        n, end = self.n_scalars, self.n_scalars + self.n_vectors
        scalar, x, y = slice(n), slice(n, end), slice(end, None)
        in_x, in_y, in_both = slice(n), slice(n, 2 * n), slice(2 * n, None)
        out = np.zeros((self.count, self.count))
        out[in_x, in_x] = out[in_y, in_y] = same[scalar, scalar]
        out[in_x, in_both], out[in_y, in_both] = same[scalar, x], same[scalar, y]
        out[in_both, in_both] = same[x, x] + same[y, y]
        if crossed is not None:
            out[in_x, in_y] = crossed[scalar, scalar]
            out[in_y, in_x] = out[in_x, in_y].T
            out[in_x, in_both] += crossed[scalar, y]
            out[in_y, in_both] -= crossed[scalar, x]
            out[in_both, in_both] += crossed[x, y] - crossed[y, x]
        out[in_both, : 2 * n] = out[: 2 * n, in_both].T
        return out


def _along(patterns: Patterns) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return which patterns but the cells are along x, the same along y, and along both axes."""
    place, first = patterns.place, 2 * len(patterns.terms)
    is_move = place < first + 3 * len(patterns.camera.turn)
    # Of a detector, shifts along x and y and a turn.
    along = np.where(place < first, place % 2, np.where(is_move, (place - first) % 3, 2))
    in_x, in_y, in_both = (np.flatnonzero(along == one) for one in range(3))
    return in_x, in_y, in_both


def order_of(patterns: Patterns, n_scalars: int) -> np.ndarray:
    """Return the place of each pattern in `Columns` that begin with those of `columns_at`.

    Parameters
    ----------
    n_scalars : number of scalars of these columns
    """
    in_x, in_y, in_both = _along(patterns)
    out, cells = np.empty(len(patterns), dtype=np.intp), np.arange(patterns.n_cells)
    out[in_x], out[in_y] = np.arange(len(in_x)), n_scalars + np.arange(len(in_y))
    out[in_both] = 2 * n_scalars + np.arange(len(in_both))
    of_cells = len(in_x) + cells
    out[len(patterns.place) :] = np.stack([of_cells, n_scalars + of_cells], axis=1).ravel()
    return out


def columns_at(
    patterns: Patterns, rows: Rows, others: Sequence[Column] = (), factor: float | np.ndarray = 1.0
) -> Columns:
    """Return the patterns at some rows: those along x, and then the cells, are the first scalars.

    Parameters
    ----------
    others : columns of parameters, which follow them
    factor : of each row, by which all are multiplied
    """
    scalars = [one.value for one in others if isinstance(one, Scalar)]
    vectors = [one for one in others if isinstance(one, Vector)]
    n_terms, n_det = len(patterns.terms), len(patterns.camera.turn)
    in_x, _, in_both = _along(patterns)
    own, own_vectors = len(in_x) + patterns.n_cells, len(in_both)
    n_scalars, n_vectors = own + len(scalars), own_vectors + len(vectors)
    values = np.zeros((rows.n, n_scalars + 2 * n_vectors))
    x, y = (legendre_at(along, max(patterns.degrees)) for along in rows.at.T)
    on = rows.detector == np.arange(n_det)[:, None]
    functions = np.stack([*(x[k] * y[j] for k, j in patterns.terms), *on], axis=1)
    place = patterns.place[in_x]
    number = np.where(place < 2 * n_terms, place // 2, n_terms + (place - 2 * n_terms) // 3)
    values[:, : len(in_x)] = functions.take(number, axis=1) * _in_time(patterns, rows, in_x)
    values[np.arange(rows.n), len(in_x) + cell_of(rows)] = 1.0
    if scalars:
        values[:, own:n_scalars] = np.stack(scalars, axis=1)
    place = patterns.place[in_both] - 2 * n_terms
    number = np.where(place < 3 * n_det, place // 3, place - 2 * n_det)
    in_time = _in_time(patterns, rows, in_both)
    for axis, functions in enumerate(_vectors(patterns, rows, on)):
        of_axis = values[:, n_scalars + axis * n_vectors :][:, :n_vectors]
        of_axis[:, :own_vectors] = functions.take(number, axis=1) * in_time
        if vectors:
            of_axis[:, own_vectors:] = np.stack([(one.x, one.y)[axis] for one in vectors], axis=1)
    values *= np.reshape(factor, (-1, 1))
    return Columns(values, n_scalars)


def _in_time(patterns: Patterns, rows: Rows, chosen: np.ndarray) -> np.ndarray:
    """Return the function of the time of the chosen patterns at each row, shape (n, chosen)."""
    times = patterns.times[patterns.time[chosen]].T
    return np.repeat(times, np.diff(rows.first), axis=0)


def _vectors(patterns: Patterns, rows: Rows, on: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return turns of the detectors, pixel phases and magnitudes, x and y of shape (n, functions).

    Parameters
    ----------
    on : whether a row is on a detector, shape (detectors, n)
    """
    turn = patterns.camera.turn
    c, s = np.cos(turn).take(rows.detector), np.sin(turn).take(rows.detector)
    # The axes of the detectors.
    axes = np.array([[c, -s], [s, c]])
    local, angle = rows.local.T, 2.0 * np.pi * rows.pixel.T
    turned = local[0] * axes[1] - local[1] * axes[0]
    parts = [on[:, None] * turned]
    for direction, one in zip(axes, angle, strict=True):
        parts.append(np.stack([np.sin(one) * direction, np.cos(one) * direction]))
    if patterns.has_magnitude:
        faintness = patterns.faintness.take(rows.source)
        for direction, one in zip(axes, local, strict=True):
            parts.append(np.stack([faintness * direction, faintness * one * direction]))
    x, y = np.concatenate(parts).transpose(1, 2, 0)
    return x, y
