"""Patterns of displacement on the focal plane that an error of the model would leave.

A pattern is a vector function of the position times a function of the time. Patterns with the
same cause make up a `Family`.
"""

from collections.abc import Iterator
from copy import copy
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from solver.results.diagnosis.rows import Camera, Rows

# Degrees of the distortion that may change during the orbit.
VARIABLE = (2, 3)
_MOST_STEPS = 3
# Cells along each side of a detector.
CELLS = 3
# Constant, linear, quadratic and cubic in time; cosine and sine of the orbital phase; then steps.
N_POWERS, N_SMOOTH = 4, 6
LINEAR, COSINE, SINE = 1, 4, 5
# Quadratic terms (x^2, xy, y^2; of each x, y) of the aberration by a velocity along x and along y:
# with a the position, v a^2 / 2 - (v a) a, where x^2 is (2 P2 + 1) / 3.
_ABERRATION = np.array(
    [[-1 / 3, 0.0], [0.0, 1 / 3], [0.0, -1.0], [-1.0, 0.0], [1 / 3, 0.0], [0.0, -1 / 3]]
)


class Family(NamedTuple):
    """The patterns of one cause.

    Attributes
    ----------
    name : of the test
    subject : what the patterns describe: "distortion", "detector", "magnitude", ...
    columns : of these patterns, indices into those of `Patterns`
    weights : coefficients of the columns in each pattern, shape (columns, patterns); None for
        the columns themselves
    what : degree, detector, axis or time that the family is about
    """

    name: str
    subject: str
    columns: np.ndarray
    weights: np.ndarray | None = None
    what: tuple[int, ...] = ()


class Patterns:
    """All patterns of an orbit.

    A column is a spatial function times a time. The spatial functions are, in this order: each
    term of the distortion along x and along y; of each detector a shift along x, along y and a
    turn; sine and cosine of the position within the pixel along each axis of the detector; and,
    where magnitudes are known, the faintness, and that times the position, along each axis.
    The last columns are the cells of the detectors, along x and y, at all times.

    Attributes
    ----------
    camera : instrument and exposures
    degrees : of the terms; `VARIABLE`, and the ones above the fitted order
    terms : the degrees of each in x and in y
    place, time : spatial function and time of each column but those of the cells
    faintness : of each source, relative to a typical one
    times : functions of the time, shape (times, exposures): constant, linear, quadratic, cubic,
        cosine and sine of the orbital phase, and a step at changes from a field to the next
    families : the causes that are looked for
    """

    def __init__(self, camera: Camera, order: int, magnitude: np.ndarray) -> None:
        """Take the camera, and number the columns.

        Parameters
        ----------
        order : highest degree of the distortion that is fitted
        magnitude : of each source; NaN where unknown
        """
        self.camera = camera
        known = np.isfinite(magnitude)
        self.has_magnitude = bool(known.any()) and float(np.ptp(magnitude[known])) > 0.0
        typical = np.median(magnitude[known]) if known.any() else 0.0
        self.faintness = 10.0 ** (0.2 * (np.where(known, magnitude, typical) - typical))
        self.times = _times(camera)
        self.degrees = [*VARIABLE, *(n for n in degrees_above(order) if n not in VARIABLE)]
        self.terms = [(n - j, j) for n in self.degrees for j in range(n + 1)]
        pairs = list(self._columns(order))
        self.place, self.time = np.array(pairs).T
        self._number = {pair: number for number, pair in enumerate(pairs)}
        self.families = families(self, order)

    def __len__(self) -> int:
        """Return the number of columns."""
        return len(self.place) + 2 * self.n_cells

    @property
    def n_cells(self) -> int:
        """The number of cells of all detectors."""
        return len(self.camera.turn) * CELLS**2

    @property
    def n_steps(self) -> int:
        """The number of steps between fields."""
        return len(self.times) - N_SMOOTH

    def at_times_of(self, camera: Camera) -> "Patterns":
        """Return the same patterns for exposures at other times."""
        other = copy(self)
        other.camera, other.times = camera, _times(camera)
        return other

    def column(self, place: int, time: int) -> int:
        """Return the column of a spatial function and a time."""
        return self._number[place, time]

    def of_degree(self, degree: int, time: int) -> np.ndarray:
        """Return the columns of the terms of a degree at a time, x and y of each in turn."""
        places = [i for i, (k, j) in enumerate(self.terms) if k + j == degree]
        return np.array([self.column(2 * i + axis, time) for i in places for axis in (0, 1)])

    def of_detector(self, detector: int, time: int) -> np.ndarray:
        """Return the columns of a detector's shift along x and y and of its turn."""
        first = 2 * len(self.terms) + 3 * detector
        return np.array([self.column(first + i, time) for i in range(3)])

    def of_axis(self, axis: int, *, magnitude: bool) -> np.ndarray:
        """Return the two columns of the pixel phase, or of the magnitude, along an axis."""
        first = 2 * len(self.terms) + 3 * len(self.camera.turn) + 2 * axis + 4 * magnitude
        return np.array([self.column(first + i, 0) for i in range(2)])

    @property
    def fast(self) -> np.ndarray:
        """The columns of patterns that change at random from exposure to exposure."""
        return np.concatenate([self.of_axis(axis, magnitude=False) for axis in (0, 1)])

    def of_cells(self, detector: int | None = None) -> np.ndarray:
        """Return the columns of the cells, of all detectors or of one."""
        first, each = len(self.place), 2 * CELLS**2
        columns = np.arange(first, len(self))
        return columns if detector is None else columns[detector * each : (detector + 1) * each]

    def _columns(self, order: int) -> Iterator[tuple[int, int]]:
        """Yield the spatial function and the time of each column but those of the cells."""
        for i, (k, j) in enumerate(self.terms):
            changes = k + j in VARIABLE
            times = [LINEAR, COSINE, SINE, *range(N_SMOOTH, len(self.times))] if changes else []
            times += [0] if k + j > order else []
            yield from ((2 * i + axis, time) for axis in (0, 1) for time in times)
        first, n_det = 2 * len(self.terms), len(self.camera.turn)
        yield from ((first + i, time) for i in range(3 * n_det) for time in range(1, N_POWERS))
        first += 3 * n_det
        yield from ((first + i, 0) for i in range(8 if self.has_magnitude else 4))


def families(patterns: Patterns, order: int) -> list[Family]:
    """Return the causes that are looked for, each with its patterns."""
    found = []
    for n in VARIABLE:
        linear, cosine, sine = (patterns.of_degree(n, time) for time in (LINEAR, COSINE, SINE))
        found.append(Family("distortion against time", "drift", linear, what=(n,)))
        both = np.concatenate([cosine, sine])
        found.append(Family("distortion against orbital phase", "bend", both, what=(n,)))
        for i in range(patterns.n_steps):
            step = patterns.of_degree(n, N_SMOOTH + i)
            found.append(Family("distortion between fields", "step", step, what=(n, i)))
    velocity = np.concatenate([patterns.of_degree(2, time) for time in (COSINE, SINE)])
    weights = np.kron(np.eye(2), _ABERRATION)
    found.append(Family("differential aberration", "velocity", velocity, weights))
    above = [patterns.of_degree(n, 0) for n in degrees_above(order)]
    found.append(Family("distortion above the order", "order", np.concatenate(above)))
    for d in range(len(patterns.camera.turn)):
        moves = np.stack([patterns.of_detector(d, time) for time in range(1, N_POWERS)])
        found.append(Family("shift of a detector", "shift", moves[:, :2].ravel(), what=(d,)))
        found.append(Family("turn of a detector", "turn", moves[:, 2], what=(d,)))
        found.append(Family("map of a detector", "cells", patterns.of_cells(d), what=(d,)))
    found.append(Family("map of the focal plane", "map", patterns.of_cells()))
    for axis in range(2):
        phase = patterns.of_axis(axis, magnitude=False)
        found.append(Family("position within the pixel", "phase", phase, what=(axis,)))
        if patterns.has_magnitude:
            faint = patterns.of_axis(axis, magnitude=True)
            found.append(Family("magnitude along an axis", "magnitude", faint, what=(axis,)))
    return found


def degrees_above(order: int) -> range:
    """Return the degrees above the fitted order that are looked for: two, and the variable ones."""
    return range(order + 1, max(order + 2, *VARIABLE) + 1)


def _times(camera: Camera) -> np.ndarray:
    """Return the functions of the time, shape (times, exposures)."""
    smooth = legendre.legvander(2.0 * camera.time, N_POWERS - 1).T
    # The linear one grows by one from the first exposure to the last.
    smooth[1] *= 0.5
    last = int(camera.field.max(initial=0))
    changes = np.unique(np.linspace(1, last, min(last, _MOST_STEPS)).round())
    phase = np.array([np.cos(camera.phase), np.sin(camera.phase)])
    return np.concatenate([smooth, phase, (camera.field >= changes[:, None]) - 0.5])


def cell_of(rows: Rows) -> np.ndarray:
    """Return the number of the cell of each row."""
    # The largest coordinate is in the last cell.
    column, row = np.minimum((0.5 * CELLS * (rows.local.T + 1.0)).astype(np.int8), CELLS - 1)
    return rows.detector * CELLS**2 + (row * CELLS + column)


def legendre_at(along: np.ndarray, degree: int) -> list[np.ndarray]:
    """Return the Legendre polynomials up to a degree, by Bonnet's recursion."""
    values = [np.ones_like(along), along]
    for n in range(1, degree):
        values.append(((2 * n + 1) * along * values[n] - n * values[n - 1]) / (n + 1))
    return values
