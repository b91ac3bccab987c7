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
    scalar : of those along x, and of those along y, shape (n, scalars)
    x, y : of the others, shape (n, vectors)
    """

    scalar: np.ndarray
    x: np.ndarray
    y: np.ndarray

    @property
    def count(self) -> int:
        """The number of columns."""
        return 2 * self.scalar.shape[1] + self.x.shape[1]

    def with_(self, others: Sequence[Column], factor: np.ndarray) -> "Columns":
        """Return these columns and those of parameters, times a factor of each row."""
        vectors = [one for one in others if isinstance(one, Vector)]
        added = (
            [one.value for one in others if isinstance(one, Scalar)],
            [one.x for one in vectors],
            [one.y for one in vectors],
        )
        return Columns(*(_joined(*parts, factor) for parts in zip(self, added, strict=True)))

    def of(self, rows: slice) -> "Columns":
        """Return the columns at some rows."""
        return Columns(*(part[rows] for part in self))

    def gram(self) -> np.ndarray:
        """Return the products of all columns with each other, shape (count, count)."""
        scalar, x, y = self
        n, own = scalar.shape[1], scalar.T @ scalar
        out = np.zeros((self.count, self.count))
        out[:n, :n] = out[n : 2 * n, n : 2 * n] = own
        out[:n, 2 * n :], out[n : 2 * n, 2 * n :] = scalar.T @ x, scalar.T @ y
        out[2 * n :, : 2 * n] = out[: 2 * n, 2 * n :].T
        out[2 * n :, 2 * n :] = x.T @ x + y.T @ y
        return out


def _joined(own: np.ndarray, added: Sequence[np.ndarray], factor: np.ndarray) -> np.ndarray:
    n = own.shape[1]
    values = np.empty((len(factor), n + len(added)))
    np.multiply(own, factor[:, None], out=values[:, :n])
    if added:
        np.multiply(np.stack(added, axis=1), factor[:, None], out=values[:, n:])
    return values


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


def columns_at(patterns: Patterns, rows: Rows) -> Columns:
    """Return the patterns at some rows: those along x, and then the cells, are the scalars."""
    n_terms, n_det = len(patterns.terms), len(patterns.camera.turn)
    in_x, _, in_both = _along(patterns)
    x, y = (legendre_at(along, max(patterns.degrees)) for along in rows.at.T)
    on = rows.detector == np.arange(n_det)[:, None]
    functions = np.stack([*(x[k] * y[j] for k, j in patterns.terms), *on], axis=1)
    place, times = patterns.place[in_x], patterns.times[patterns.time[in_x]].T
    number = np.where(place < 2 * n_terms, place // 2, n_terms + (place - 2 * n_terms) // 3)
    scalar = np.zeros((rows.n, len(in_x) + patterns.n_cells))
    np.multiply(functions[:, number], times[rows.exposure], out=scalar[:, : len(in_x)])
    scalar[np.arange(rows.n), len(in_x) + cell_of(rows)] = 1.0
    place, times = patterns.place[in_both] - 2 * n_terms, patterns.times[patterns.time[in_both]].T
    number = np.where(place < 3 * n_det, place // 3, place - 2 * n_det)
    vectors = _vectors(patterns, rows, on)
    return Columns(scalar, *(one[:, number] * times[rows.exposure] for one in vectors))


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
