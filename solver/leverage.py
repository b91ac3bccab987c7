"""Leverage: how far each measurement pulls its own prediction, and residuals freed of it.

With the whitened Jacobian J_k of measurement k and the marginal covariance C of all
parameters, H_k = J_k C J_k' (2 x 2). The expected chi2 of the measurement is
2 - tr H_k, and (I - H_k)^(-1/2) r_k has unit covariance if model and sigmas are right.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from solver.linearise import Linearised
from solver.normal import Segment, chunks, one_blas_thread, segments
from solver.problem import Problem
from solver.schur import Reduced


class Residuals(NamedTuple):
    """Residuals of the measurements, in working order.

    `whitened` is (measured minus predicted) / sigma; `standardised` the same freed of
    leverage, NaN where a measurement determines its own prediction; `trace` is that of H;
    the positions are those of `solver.forward.Prediction`.
    """

    whitened: Float[np.ndarray, "obs 2"]
    standardised: Float[np.ndarray, "obs 2"]
    trace: Float[np.ndarray, " obs"]
    pixel: Float[np.ndarray, "obs 2"]
    ideal: Float[np.ndarray, "obs 2"]
    focal: Float[np.ndarray, "obs 2"]


class Covariances(NamedTuple):
    """Marginal covariances of sources, calibration, and between the two."""

    source: Float[np.ndarray, "src 2 2"]
    theta: Float[np.ndarray, "calib calib"]
    cross: Float[np.ndarray, "src 2 calib"]


def covariances(reduced: Reduced) -> Covariances:
    """Return all marginal covariances of a factorised posterior."""
    spread = reduced.spread()
    return Covariances(
        reduced.marginal_covariance(spread),
        reduced.theta_covariance(),
        reduced.cross_covariance(spread),
    )


def residuals(
    problem: Problem,
    theta: Float[np.ndarray, " calib"],
    sources: Float[np.ndarray, "src 2"],
    covariance: Covariances,
) -> Residuals:
    """Return the residuals at a point, with their leverage."""
    parts = []
    for rows, chunk in chunks(problem, theta, sources):
        leverage = np.empty((len(chunk.residual), 2, 2))
        with one_blas_thread():
            for segment in segments(problem, rows, chunk):
                leverage[segment.rows] = _leverage(segment, chunk, covariance)
        parts.append(
            Residuals(
                chunk.residual,
                _standardised(chunk.residual, leverage),
                np.trace(leverage, axis1=1, axis2=2),
                chunk.prediction.pixel,
                chunk.prediction.ideal,
                chunk.prediction.focal,
            )
        )
    return Residuals(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _leverage(
    segment: Segment, chunk: Linearised, covariance: Covariances
) -> Float[np.ndarray, "seg 2 2"]:
    """Return J C J' from its source, calibration and mixed parts."""
    jacobian, columns = segment.jacobian, np.r_[segment.columns]
    by_source = chunk.source[segment.rows]
    of_theta = jacobian @ covariance.theta[np.ix_(columns, columns)]
    cross = [covariance.cross[segment.source, :, run] for run in segment.columns]
    mixed = by_source @ np.concatenate(cross, axis=-1)
    half = (0.5 * of_theta + mixed) @ np.swapaxes(jacobian, 1, 2)
    of_source = by_source @ covariance.source[segment.source] @ np.swapaxes(by_source, 1, 2)
    return of_source + half + np.swapaxes(half, 1, 2)


def _standardised(
    residual: Float[np.ndarray, "obs 2"], leverage: Float[np.ndarray, "obs 2 2"]
) -> Float[np.ndarray, "obs 2"]:
    """Return (I - H)^(-1/2) r, by the closed form of a 2 x 2 root."""
    rest = np.eye(2) - leverage
    determinant = rest[:, 0, 0] * rest[:, 1, 1] - rest[:, 0, 1] * rest[:, 1, 0]
    # Below this the measurement alone decides its prediction, and rounding its residual.
    usable = (determinant > 1e-12) & (np.trace(rest, axis1=1, axis2=2) > 0.0)
    root = np.sqrt(np.where(usable, determinant, 1.0))
    trace = np.where(usable, np.trace(rest, axis1=1, axis2=2), 1.0)
    scale = np.sqrt(trace + 2.0 * root)
    square_root = (rest + root[:, None, None] * np.eye(2)) / scale[:, None, None]
    square_root[~usable] = np.eye(2)
    solved = np.linalg.solve(square_root, residual[:, :, None])[:, :, 0]
    solved[~usable] = np.nan
    return solved
