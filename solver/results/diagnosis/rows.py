"""The residuals of a solution on the focal plane, in the order of the exposures."""

from typing import NamedTuple

import numpy as np

from solver.data.detector_spans import Move, span_numbers, with_moves
from solver.data.result import FitResult
from solver.results.diagnosis.sorted_table import (
    ResidualColumns,
    SortedTable,
    read_columns,
    sorted_table,
)
from solver.units import MINUTES_PER_DAY, RAD_PER_MAS

# Sigmas beyond which a residual is an outlier: one good one in five hundred million is.
FAR = 6.0
# Median of the larger of two chi2 with one degree of freedom each.
_MEDIAN_OF_LARGER = 1.1063
# Of exposures whose functions are computed together: less would be many small steps.
_ROWS_OF_BLOCK = 8_192
# Residuals of which the fit leaves less than this share are rounding errors.
_LEAST_LEFT = 1e-6


class Rows(NamedTuple):
    """The residuals of n measurements along the axes of the focal plane.

    Attributes
    ----------
    exposure, detector, source : index into the exposures, the detectors and the sources of the
        result, shape (n,); exposures ascend, and in each of them the detectors
    first : row of the first measurement of each exposure, and n, shape (exposures + 1,)
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
    first: np.ndarray
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

    def of(self, chosen: np.ndarray | slice) -> "Rows":
        """Return the chosen rows, ascending indices or a slice."""
        parts = [column[chosen] for name, column in self._asdict().items() if name != "first"]
        exposure, detector, source, *rest = parts
        first = np.searchsorted(exposure, np.arange(len(self.first)))
        return Rows(exposure, detector, source, first, *rest)


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


def camera_rows(result: FitResult) -> tuple[Camera, Rows]:
    """Return the residuals of a result, and its camera."""
    detectors = result.values_on("det")
    turn = np.radians(detectors["detector_rotation"].to_numpy())
    pitch = detectors[["pitch_x", "pitch_y"]].to_numpy()
    table = sorted_table(result, len(turn))
    columns = read_columns(table, result.sources["source_id"].to_numpy())
    half = _largest(columns.pixel, table.detector, len(turn))
    scale = _distortion_scale(result, columns.focal)
    camera = _camera(result, turn, pitch, half, scale)
    return camera, _rows(table, columns, camera)


def _distortion_scale(result: FitResult, focal: np.ndarray) -> float:
    """Return the unit of the distortion's coordinates, um.

    Parameters
    ----------
    focal : positions on the focal plane, um, shape (n, 2)
    """
    # Older results lack it; the largest coordinate is near.
    largest = np.abs(focal).max(initial=1.0)
    return float(result.summary.get("distortion_scale_um", largest))


def _rows(table: SortedTable, columns: ResidualColumns, camera: Camera) -> Rows:
    """Return the residuals on the focal plane."""
    detector = table.detector
    um = camera.pitch.T.take(detector, axis=1).T
    first = np.searchsorted(table.exposure, np.arange(len(camera.time) + 1))
    left = 1.0 - np.clip(0.5 * table.column("leverage"), 0.0, 1.0)
    # Each axis is contiguous: sums of the two are twice as fast as along the second one.
    square_x, square_y = np.square(columns.residual / columns.sigma).T
    is_far = _far(np.maximum(square_x, square_y), left, first)
    used = columns.residual * um
    used[is_far] = 0.0
    sigma_x, sigma_y = (columns.sigma * um).T
    return Rows(
        exposure=table.exposure,
        detector=detector,
        source=columns.source,
        first=first,
        at=columns.focal / camera.scale,
        pixel=columns.pixel,
        local=columns.pixel / camera.half.T.take(detector, axis=1).T,
        residual=onto_focal_plane(used, camera.turn, detector),
        weight=2.0 / (np.square(sigma_x) + np.square(sigma_y)),
        left=left,
        chi2=square_x + square_y,
        is_far=is_far,
    )


def _largest(pixel: np.ndarray, detector: np.ndarray, n_det: int) -> np.ndarray:
    """Return the largest coordinate on each detector along its axes, at least one."""
    starts = np.flatnonzero(np.diff(detector, prepend=-1))
    largest = np.ones((n_det, 2))
    if len(starts):
        np.maximum.at(largest, detector[starts], np.maximum.reduceat(np.abs(pixel), starts))
    return largest


def onto_focal_plane(vector: np.ndarray, turn: np.ndarray, detector: np.ndarray) -> np.ndarray:
    """Return vectors along the axes of their detectors as vectors on the focal plane.

    Parameters
    ----------
    vector : shape (n, 2)
    turn : rotation of each detector, rad; the inverse of Eq. (exp:model:nxny)
    detector : of each vector, shape (n,)
    """
    c, s = np.cos(turn).take(detector), np.sin(turn).take(detector)
    (x, y), found = vector.T, np.empty((2, len(vector)))
    np.add(c * x, s * y, out=found[0])
    np.subtract(c * y, s * x, out=found[1])
    return found.T


def _far(squares: np.ndarray, left: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return which measurements are far off, by the scatter of their exposure, which is robust.

    Parameters
    ----------
    squares : of the residual over its uncertainty, of the axis where it is larger
    """
    squares = squares / np.maximum(left, _LEAST_LEFT)
    is_far = squares > FAR**2
    # An exposure that scatters by more has fewer of them, never more.
    for exposure in np.unique(np.searchsorted(first, np.flatnonzero(is_far), side="right") - 1):
        rows = slice(first[exposure], first[exposure + 1])
        scale = max(float(np.median(squares[rows])) / _MEDIAN_OF_LARGER, 1.0)
        is_far[rows] = squares[rows] > FAR**2 * scale
    return is_far & (left > _LEAST_LEFT)


def detector_spans(result: FitResult) -> np.ndarray:
    """Return the number of the span of each exposure in which detectors do not move, from 0."""
    moves = [Move(**one) for one in result.summary.get("detector_moves", [])]
    return span_numbers(with_moves(result.exposures, moves))


def _camera(
    result: FitResult, turn: np.ndarray, pitch: np.ndarray, half: np.ndarray, scale: float
) -> Camera:
    exposures, fitted = result.exposures, result.values_on("exp")
    days = exposures["obstime"].to_numpy()
    span = max(float(np.ptp(days)), 1e-12)
    start = exposures.groupby("field_id")["obstime"].transform("min")
    roll = np.radians(fitted["position_angle"].to_numpy())
    period = result.settings.breathing_period / MINUTES_PER_DAY
    return Camera(
        turn=turn,
        pitch=pitch,
        half=half,
        centre=result.values_on("det", "prior_centre")[["detector_x", "detector_y"]].to_numpy(),
        scale=scale,
        roll=roll - roll[0],
        time=(days - days.min()) / span - 0.5,
        phase=2.0 * np.pi * (days - 0.5 * (days.min() + days.max())) / period,
        field=np.unique(start.to_numpy(), return_inverse=True)[1],
        span=detector_spans(result),
        um_per_mas=float(fitted["focal_length"].mean()) * RAD_PER_MAS,
    )
