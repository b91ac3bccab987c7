"""Results whose residuals are a given field on the focal plane, or noise that a fit has left."""

from dataclasses import replace

import numpy as np

from plateviz.tables.focal_residuals import focal_residuals
from solver.data.instrument import MINI_MOCK
from solver.data.result import FitResult

SIGMA_MPIX = 10.0
MAS_PER_MPIX = 1e-5 / 4.86 * np.degrees(1.0) * 3.6e6 * 1e-3


def with_field(result: FitResult, field: np.ndarray) -> FitResult:
    """Return the result with residuals that are `field` (n, 2), mpix along the focal plane."""
    turn = np.radians(result.values_on("det")["detector_rotation"].to_numpy())
    at = turn[MINI_MOCK.index_of(result.residuals["detector_id"].to_numpy())]
    x = np.cos(at) * field[:, 0] - np.sin(at) * field[:, 1]
    y = np.sin(at) * field[:, 0] + np.cos(at) * field[:, 1]
    rows = result.residuals.assign(residual_x=1e-3 * x, residual_y=1e-3 * y)
    return replace(result, residuals=rows)


def without_absorption(result: FitResult) -> FitResult:
    """Return the result as if sources and calibration had been known before the fit."""
    known = {"sigma_ra_conditional": 0.0, "sigma_dec_conditional": 0.0}
    return replace(
        result,
        residuals=result.residuals.assign(leverage=0.0),
        sources=result.sources.assign(**known),
        calibration=result.calibration.assign(prior_share=1.0),
    )


def without_distortion(result: FitResult, order: int) -> FitResult:
    """Return the result as that of a fit of order 0 or 1, which has no terms of the distortion."""
    is_term = result.calibration["group"].isin(["distortion_x", "distortion_y"])
    return replace(
        result,
        calibration=result.calibration[~is_term].reset_index(drop=True),
        settings=replace(result.settings, order=order),
    )


def with_fitted_sources(result: FitResult) -> FitResult:
    """Return the result as if only the positions of the sources had been fitted, without priors."""
    counts = result.residuals.groupby("source_id")["nx"].transform("size")
    sigma = SIGMA_MPIX * MAS_PER_MPIX / np.sqrt(result.sources["n_obs"])
    return replace(
        without_absorption(result),
        residuals=result.residuals.assign(leverage=2.0 / counts),
        sources=result.sources.assign(sigma_ra_conditional=sigma, sigma_dec_conditional=sigma),
    )


def left_by_sources(result: FitResult, field: np.ndarray) -> np.ndarray:
    """Return what a fit of the sources' positions leaves of a field (n, 2)."""
    source = focal_residuals(result, MINI_MOCK).source
    counts = np.bincount(source)
    means = np.stack([np.bincount(source, of_axis) / counts for of_axis in field.T], axis=-1)
    return field - means[source]


def moves_of(at: np.ndarray) -> np.ndarray:
    """Return shift in x, in y, roll and scale at places (n, 2), as columns (2 n, 4)."""
    (x, y), zero, one = at.T, np.zeros(len(at)), np.ones(len(at))
    moves = [(one, zero), (zero, one), (-y, x), (x, y)]
    return np.stack([np.stack(move, axis=-1).ravel() for move in moves], axis=-1)


def left_by_exposures(result: FitResult, field: np.ndarray) -> np.ndarray:
    """Return what fits of pointing, roll and scale of each exposure leave of a field (n, 2)."""
    found = focal_residuals(result, MINI_MOCK)
    left = np.empty_like(field)
    for exposure in np.unique(found.exposure):
        on = found.exposure == exposure
        design, values = moves_of(found.at[on]), field[on].ravel()
        fitted = design @ np.linalg.lstsq(design, values, rcond=None)[0]
        left[on] = (values - fitted).reshape(-1, 2)
    return left
