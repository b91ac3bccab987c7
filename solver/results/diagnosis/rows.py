"""The residuals of a solution on the focal plane, in the order of the exposures."""

import itertools
from typing import NamedTuple

import numpy as np
import pandas as pd

from solver.data.result import FitResult
from solver.units import RAD_PER_MAS

# Sigmas beyond which a residual is an outlier: one good one in five hundred million is.
FAR = 6.0
# Median of the larger of two chi2 with one degree of freedom each.
_MEDIAN_OF_LARGER = 1.1063
_MINUTES_PER_DAY = 1440.0
# Residuals of which the fit leaves less than this share are rounding errors.
_LEAST_LEFT = 1e-6


class Rows(NamedTuple):
    """The residuals of n measurements along the axes of the focal plane.

    Attributes
    ----------
    exposure, detector, source : index into the exposures, the detectors and the sources of the
        result, shape (n,); exposures ascend
    first : row of the first measurement of each exposure, and n, shape (exposures + 1,)
    at : position on the focal plane over `Camera.scale`, shape (n, 2)
    pixel : measured position, from the centre of the detector, pixels, shape (n, 2)
    residual : measured minus predicted, um, shape (n, 2)
    weight : inverse variance of a measurement along one axis, um^-2, shape (n,)
    left : share of an error of the measurement that stays in its residual, shape (n,)
    whitened : residual over the stated uncertainty along the axes of the detector, shape (n, 2)
    is_far : whether the measurement is an outlier, shape (n,); its `residual` is zero
    """

    exposure: np.ndarray
    detector: np.ndarray
    source: np.ndarray
    first: np.ndarray
    at: np.ndarray
    pixel: np.ndarray
    residual: np.ndarray
    weight: np.ndarray
    left: np.ndarray
    whitened: np.ndarray
    is_far: np.ndarray

    @property
    def n(self) -> int:
        """Number of measurements."""
        return len(self.exposure)

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
    um_per_mas: float


def camera_rows(result: FitResult) -> tuple[Camera, Rows]:
    """Return the residuals of a result, and its camera."""
    table, detectors = result.residuals, result.values_on("det")
    rotation = result.calibration["group"] == "detector_rotation"
    labels = result.calibration.loc[rotation, "label"].str.split().str[-1]
    ids = labels.to_numpy(dtype=np.int64)
    order = np.argsort(ids)
    found = np.searchsorted(ids[order], table["detector_id"].to_numpy())
    turn = np.radians(detectors["detector_rotation"].to_numpy())
    pitch = detectors[["pitch_x", "pitch_y"]].to_numpy()
    exposure = result.exposure_index
    is_sorted = bool(np.all(exposure[1:] >= exposure[:-1]))
    by_exposure = slice(None) if is_sorted else np.argsort(exposure, kind="stable")
    exposure = exposure[by_exposure]
    detector = order[found][by_exposure]

    def pair(name: str) -> np.ndarray:
        return table[[f"{name}x", f"{name}y"]].to_numpy()[by_exposure]

    pixel, sigma, focal = pair("n"), pair("s"), pair("focal_")
    residual, variance = pair("residual_"), np.square(sigma * pitch[detector]).mean(axis=1)
    first = np.searchsorted(exposure, np.arange(len(result.exposures) + 1))
    left = 1.0 - np.clip(0.5 * table["leverage"].to_numpy()[by_exposure], 0.0, 1.0)
    is_far = _far(residual / sigma, left, first)
    # Older results lack it; the largest coordinate is near.
    largest = np.abs(focal).max(initial=1.0)
    scale = float(result.summary.get("distortion_scale_um", largest))
    half = np.array(
        [np.abs(pixel[detector == one]).max(axis=0, initial=1.0) for one in range(len(turn))]
    )
    # Few ids are searched for: all of them would take ten times as long.
    source, known = pd.factorize(table["source_id"].to_numpy()[by_exposure])
    rows = Rows(
        exposure,
        detector,
        np.searchsorted(result.sources["source_id"].to_numpy(), known)[source],
        first,
        focal / scale,
        pixel,
        onto_focal_plane(residual * pitch[detector], turn[detector]) * ~is_far[:, None],
        1.0 / variance,
        left,
        residual / sigma,
        is_far,
    )
    return _camera(result, turn, pitch, half, scale), rows


def onto_focal_plane(vector: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Return vectors along the axes of their detectors as vectors on the focal plane.

    Parameters
    ----------
    turn : rotation of the detector of each vector, rad; the inverse of Eq. (exp:model:nxny)
    """
    c, s = np.cos(turn), np.sin(turn)
    x, y = vector[:, 0], vector[:, 1]
    return np.stack([c * x + s * y, c * y - s * x], axis=1)


def _far(whitened: np.ndarray, left: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return which measurements are far off, by the scatter of their exposure, which is robust."""
    squares = np.square(whitened).max(axis=1) / np.maximum(left, _LEAST_LEFT)
    is_far = np.zeros(len(squares), dtype=bool)
    for start, end in itertools.pairwise(first):
        if end > start:
            scale = max(float(np.median(squares[start:end])) / _MEDIAN_OF_LARGER, 1.0)
            is_far[start:end] = squares[start:end] > FAR**2 * scale
    return is_far & (left > _LEAST_LEFT)


def _camera(
    result: FitResult, turn: np.ndarray, pitch: np.ndarray, half: np.ndarray, scale: float
) -> Camera:
    exposures, fitted = result.exposures, result.values_on("exp")
    days = exposures["obstime"].to_numpy()
    span = max(float(np.ptp(days)), 1e-12)
    start = exposures.groupby("field_id")["obstime"].transform("min")
    roll = np.radians(fitted["position_angle"].to_numpy())
    period = result.settings.breathing_period / _MINUTES_PER_DAY
    return Camera(
        turn,
        pitch,
        half,
        result.values_on("det", "prior_centre")[["detector_x", "detector_y"]].to_numpy(),
        scale,
        roll - roll[0],
        (days - days.min()) / span - 0.5,
        2.0 * np.pi * (days - 0.5 * (days.min() + days.max())) / period,
        np.unique(start.to_numpy(), return_inverse=True)[1],
        float(fitted["focal_length"].mean()) * RAD_PER_MAS,
    )
