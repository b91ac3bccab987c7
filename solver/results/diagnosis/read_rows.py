"""Reads the residuals of a solution for its tests: large columns, by two threads at once."""

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from solver.data.result import FitResult
from solver.results.diagnosis.outliers import are_outliers
from solver.results.diagnosis.rows import Camera, Rows, detector_spans, turned
from solver.results.diagnosis.sorted_table import SortedTable, places_of_sources, sorted_table
from solver.units import MINUTES_PER_DAY, RAD_PER_MAS

# Residuals of which the fit leaves less than this share are rounding errors.
_LEAST_LEFT = 1e-6


def camera_rows(result: FitResult) -> tuple[Camera, Rows]:
    """Return the residuals of a result, and its camera."""
    turn = np.radians(result.values_of("detector_rotation"))
    pitch = np.stack([result.values_of(f"pitch_{axis}") for axis in "xy"], axis=1)
    with ThreadPoolExecutor(1) as thread:
        sources = thread.submit(places_of_sources, result)
        table = sorted_table(result, len(turn))
        # As much for the one thread as for the other.
        sigma, left = thread.submit(table.pair, "s"), thread.submit(_left, table)
        places = thread.submit(_places, result, table, len(turn))
        residual = table.pair("residual_")
        sizes = _sizes(table, pitch, turn, residual, sigma.result(), left.result())
        first = np.searchsorted(table.exposure, np.arange(len(result.exposures) + 1))
        source, place = sources.result().take(table.order), places.result()
    camera = _camera(result, turn, pitch, place)
    return camera, Rows(
        exposure=table.exposure,
        detector=table.detector,
        source=source,
        stored=table.order,
        first=first,
        runs=table.runs,
        at=place.at,
        pixel=place.pixel,
        local=place.local,
        **sizes._asdict(),
    )


class _Places(NamedTuple):
    """Where the measurements are; `half` and `scale` as in `Camera`, the others as in `Rows`."""

    pixel: np.ndarray
    local: np.ndarray
    at: np.ndarray
    half: np.ndarray
    scale: float


def _places(result: FitResult, table: SortedTable, n_det: int) -> _Places:
    pixel, focal = table.pair("n"), table.pair("focal_")
    half = _largest(pixel, table, n_det)
    scale = result.summary.get("distortion_scale_um")
    if scale is None:
        # Older results lack the unit of the distortion's coordinates; the largest is near.
        scale = np.abs(focal).max(initial=1.0)
    scale = float(scale)
    local = pixel / table.of_detectors(half.T).T
    focal /= scale
    return _Places(pixel, local, focal, half, scale)


def _largest(pixel: np.ndarray, table: SortedTable, n_det: int) -> np.ndarray:
    """Return the largest coordinate on each detector along its axes, at least one."""
    largest = np.ones((n_det, 2))
    if len(table.runs):
        of_run = np.maximum.reduceat(np.abs(pixel), table.runs)
        np.maximum.at(largest, table.detector[table.runs], of_run)
    return largest


class _Sizes(NamedTuple):
    """How large the residuals are, and how large they may be; as in `Rows`."""

    residual: np.ndarray
    weight: np.ndarray
    left: np.ndarray
    chi2: np.ndarray
    is_far: np.ndarray


def _left(table: SortedTable) -> np.ndarray:
    """Return the share of an error of each measurement that stays in its residual."""
    left = table.column("leverage")
    left *= -0.5
    left += 1.0
    return np.clip(left, 0.0, 1.0, out=left)


def _sizes(
    table: SortedTable,
    pitch: np.ndarray,
    turn: np.ndarray,
    residual: np.ndarray,
    sigma: np.ndarray,
    left: np.ndarray,
) -> _Sizes:
    """Return the sizes from residuals and uncertainties, pixels, which are overwritten.

    In place, where that is possible: each pass over all measurements counts.
    """
    # Each axis is contiguous: sums of the two are twice as fast as along the second one.
    squares = residual / sigma
    square_x, square_y = np.square(squares, out=squares).T
    largest = np.maximum(square_x, square_y) / np.maximum(left, _LEAST_LEFT)
    is_far = are_outliers(largest, table.exposure) & (left > _LEAST_LEFT)
    um = table.of_detectors(pitch.T).T
    residual *= um
    residual[is_far] = 0.0
    sigma *= um
    variance_x, variance_y = np.square(sigma, out=sigma).T
    return _Sizes(
        residual=turned(residual, *table.of_detectors(np.stack([np.cos(turn), np.sin(turn)]))),
        weight=2.0 / (variance_x + variance_y),
        left=left,
        chi2=square_x + square_y,
        is_far=is_far,
    )


def _camera(result: FitResult, turn: np.ndarray, pitch: np.ndarray, place: _Places) -> Camera:
    exposures = result.exposures
    days = exposures["obstime"].to_numpy()
    span = max(float(np.ptp(days)), 1e-12)
    ids, of_exposure = np.unique(exposures["field_id"].to_numpy(), return_inverse=True)
    start = np.full(len(ids), np.inf)
    np.minimum.at(start, of_exposure, days)
    roll = np.radians(result.values_of("position_angle"))
    centre = [result.values_of(f"detector_{axis}", "prior_centre") for axis in "xy"]
    period = result.settings.breathing_period / MINUTES_PER_DAY
    return Camera(
        turn=turn,
        pitch=pitch,
        half=place.half,
        centre=np.stack(centre, axis=1),
        scale=place.scale,
        roll=roll - roll[0],
        time=(days - days.min()) / span - 0.5,
        phase=2.0 * np.pi * (days - 0.5 * (days.min() + days.max())) / period,
        field=np.unique(start[of_exposure], return_inverse=True)[1],
        span=detector_spans(result),
        um_per_mas=float(result.values_of("focal_length").mean()) * RAD_PER_MAS,
    )
