"""The residuals of a solution on the focal plane, in the order of the exposures."""

from typing import NamedTuple

import numpy as np

from solver.data.detector_spans import Move, span_numbers, with_moves
from solver.data.result import FitResult
from solver.results.diagnosis.sorted_table import over_runs, runs_of

# Of exposures whose functions are computed together: less would be many small steps.
_ROWS_OF_BLOCK = 16_384


class Rows(NamedTuple):
    """The residuals of n measurements along the axes of the focal plane.

    Attributes
    ----------
    exposure, detector, source : index into the exposures, the detectors and the sources of the
        result, shape (n,); exposures ascend, and in each of them the detectors
    stored : row of the table of residuals of the result, shape (n,)
    first : row of the first measurement of each exposure, and n, shape (exposures + 1,)
    runs : row of the first measurement of each exposure on each of its detectors, shape (runs,)
    at : position on the focal plane over `Camera.scale`, shape (n, 2)
    pixel : measured position, from the centre of the detector, pixels, shape (n, 2)
    local : the same over `Camera.half`, shape (n, 2)
    residual : measured minus predicted, um, shape (n, 2)
    weight : inverse variance of a measurement along one axis, um^-2, shape (n,)
    left : share of an error of the measurement that stays in its residual, shape (n,)
    chi2 : of the residual along both axes, by the stated uncertainties, shape (n,)
    is_far : whether the measurement is an outlier, shape (n,); its `residual` is zero
    """

    exposure: np.ndarray
    detector: np.ndarray
    source: np.ndarray
    stored: np.ndarray
    first: np.ndarray
    runs: np.ndarray
    at: np.ndarray
    pixel: np.ndarray
    local: np.ndarray
    residual: np.ndarray
    weight: np.ndarray
    left: np.ndarray
    chi2: np.ndarray
    is_far: np.ndarray

    @property
    def n(self) -> int:
        """Number of measurements."""
        return len(self.exposure)

    def blocks(self) -> list[range]:
        """Return the exposures in blocks, whose columns of functions stay in the cache."""
        each = int(_ROWS_OF_BLOCK / max(np.diff(self.first).max(initial=1), 1))
        n, step = len(self.first) - 1, max(each, 1)
        return [range(start, min(start + step, n)) for start in range(0, n, step)]

    def of(self, chosen: np.ndarray) -> "Rows":
        """Return the chosen rows, ascending indices."""
        of_each = {
            # Each axis stays contiguous.
            name: column.T.take(chosen, axis=-1).T
            for name, column in self._asdict().items()
            if name not in ("first", "runs")
        }
        exposure, detector = of_each["exposure"], of_each["detector"]
        first = np.searchsorted(exposure, np.arange(len(self.first)))
        return Rows(**of_each, first=first, runs=runs_of(exposure, detector))

    def of_detectors(self, values: np.ndarray) -> np.ndarray:
        """Return at each row what is of its detector, shape (..., n), from (..., detectors)."""
        return over_runs(values.take(self.detector[self.runs], axis=-1), self.runs, self.n)

    def in_runs(self, values: np.ndarray) -> np.ndarray:
        """Return the sum of values, shape (n,), over each of the `runs`."""
        return np.add.reduceat(values, self.runs) if self.n else np.empty(0)

    def in_exposures(self, values: np.ndarray) -> np.ndarray:
        """Return the sum of values, shape (n,), over each exposure."""
        return np.bincount(self.exposure[self.runs], self.in_runs(values), len(self.first) - 1)


class Camera(NamedTuple):
    """What the patterns need to know about the instrument and the exposures of a result.

    Attributes
    ----------
    turn : rotation of each detector, rad
    pitch : of each detector along x and y, um, shape (detectors, 2)
    half : largest coordinate of a measurement on each detector, pixels, shape (detectors, 2)
    centre : nominal place of each detector, um, shape (detectors, 2)
    scale : unit of the distortion's coordinates, um
    roll : position angle of each exposure, from that of the first, rad
    time : of each exposure, from -0.5 for the first to 0.5 for the last
    phase : of the satellite's orbit about the Earth, zero in the middle of the exposures, rad
    field : number of the field of each exposure, from 0, in order of time
    span : of the exposures among which detectors do not move (`solver.data.detector_spans`)
    um_per_mas : on the focal plane
    """

    turn: np.ndarray
    pitch: np.ndarray
    half: np.ndarray
    centre: np.ndarray
    scale: float
    roll: np.ndarray
    time: np.ndarray
    phase: np.ndarray
    field: np.ndarray
    span: np.ndarray
    um_per_mas: float

    def on_sky(self, size_um: float) -> float:
        """Return an rms displacement on the focal plane as one along one axis of the sky, mas."""
        return size_um / self.um_per_mas / float(np.sqrt(2.0))


def onto_focal_plane(vector: np.ndarray, turn: np.ndarray, detector: np.ndarray) -> np.ndarray:
    """Return vectors along the axes of their detectors as vectors on the focal plane.

    Parameters
    ----------
    vector : shape (n, 2)
    turn : rotation of each detector, rad; the inverse of Eq. (exp:model:nxny)
    detector : of each vector, shape (n,)
    """
    return turned(vector, np.cos(turn).take(detector), np.sin(turn).take(detector))


def turned(vector: np.ndarray, c: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Return vectors, shape (n, 2), turned back by angles of which these are cosine and sine."""
    (x, y), found = vector.T, np.empty((2, len(vector)))
    np.add(c * x, s * y, out=found[0])
    np.subtract(c * y, s * x, out=found[1])
    return found.T


def detector_spans(result: FitResult) -> np.ndarray:
    """Return the number of the span of each exposure in which detectors do not move, from 0."""
    moves = [Move(**one) for one in result.summary.get("detector_moves", [])]
    return span_numbers(with_moves(result.exposures, moves))
