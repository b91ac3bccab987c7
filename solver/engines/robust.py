"""Robust fitting: outliers are found with a heavy-tailed likelihood and left out.

Under Student's t the weight of a measurement falls with its residual, so a few bad measurements
hardly affect the solution. Measurements with larger residuals than expected of any good one are
outliers; the others are fitted without them, with a normal likelihood, for which uncertainties
and diagnostics are exact.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float

from solver.data.orbit import OrbitData
from solver.data.schema import OUTLIERS
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Iteration, Mode, find_mode
from solver.linear.covariances import marginal_covariance
from solver.linear.leverage import of_slots
from solver.linear.linearised_chunks import linearised_chunks
from solver.problem.problem import Problem, of_rows

# Degrees of freedom of Student's t: few, so that outliers have little weight.
_NU = 4.0
# Largest change of converged weights, and the maximum number of iterations.
_WEIGHT_TOLERANCE = 1e-3
_MAX_ROUNDS = 30
# Mean number of good measurements per orbit that are taken for outliers.
_FALSE_ALARMS = 0.01


class Outliers(NamedTuple):
    """Outliers among the measurements, in working order.

    Attributes
    ----------
    found : whether each measurement is an outlier
    residual : measured minus predicted, pixels
    distance : length of the residual in sigmas
    shift : shift of its source in alpha* and delta if the outlier were used, over the marginal
        sigma
    """

    found: Bool[np.ndarray, " obs"]
    residual: Float[np.ndarray, "out 2"]
    distance: Float[np.ndarray, " out"]
    shift: Float[np.ndarray, "out 2"]


def find_outliers(
    problem: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
) -> Outliers | None:
    """Fit with Student's t and return the outliers.

    Returns
    -------
    None if the problem has no solution; the fit that follows reports the reason.
    """
    last = _reweighted_fit(problem, settings, progress)
    if last is None:
        return None
    # The squared distance of a good measurement is exponentially distributed with mean two. Where
    # errors are larger than stated, many good ones are beyond what is expected of the best.
    larger = max(1.0, float(np.median(last.squares)) / (2.0 * np.log(2.0)))
    limit = 2.0 * np.log(problem.n_obs / _FALSE_ALARMS) * larger
    return _outliers(problem, last.mode, last.squares > limit)


def with_robust_weights(
    problem: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
) -> Problem:
    """Return the problem with the uncertainties that give the measurements Student's t weights.

    It is the same problem if it has no solution.
    """
    last = _reweighted_fit(problem, settings, progress)
    return problem if last is None else _weighted(problem, last.weight)


class _ReweightedFit(NamedTuple):
    """The last fit of a series, in which the weights follow the residuals of the fit before.

    Attributes
    ----------
    squares : squared distances of the measurements from their predictions, in stated sigmas
    weight : Student's t weights at these distances
    """

    mode: Mode
    squares: Float[np.ndarray, " obs"]
    weight: Float[np.ndarray, " obs"]


def _reweighted_fit(
    problem: Problem, settings: FitSettings, progress: Callable[[Iteration], None]
) -> _ReweightedFit | None:
    """Fit with Student's t; None if the problem has no solution."""
    mode = find_mode(problem, settings, progress)
    weight = np.ones(problem.n_obs)
    for _ in range(_MAX_ROUNDS):
        if mode.reduced is None:
            return None
        squares = (whitened_residuals(problem, mode) ** 2).sum(axis=1)
        before, weight = weight, (_NU + 2.0) / (_NU + squares)
        if np.abs(weight - before).max() < _WEIGHT_TOLERANCE:
            break
        mode = find_mode(_weighted(problem, weight), settings, progress, start=mode)
    else:
        # The last fit was made with these weights, but is not the one that they follow from.
        if mode.reduced is None:
            return None
        squares = (whitened_residuals(problem, mode) ** 2).sum(axis=1)
    return _ReweightedFit(mode, squares, weight)


def outlier_table(
    outliers: Outliers | None, problem: Problem, data: OrbitData
) -> pd.DataFrame | None:
    """Return `schema.OUTLIERS`, most distant first, with the index labels of the measurements.

    Parameters
    ----------
    data : tables that the problem was built from
    """
    if outliers is None:
        return None
    table = data.measurements.iloc[problem.measurements.row[outliers.found]].assign(
        residual_x=outliers.residual[:, 0],
        residual_y=outliers.residual[:, 1],
        distance=outliers.distance,
        shift_ra=outliers.shift[:, 0],
        shift_dec=outliers.shift[:, 1],
    )
    return table[OUTLIERS.names].sort_values("distance", ascending=False)


def _weighted(problem: Problem, weight: Float[np.ndarray, " obs"]) -> Problem:
    measurements = problem.measurements
    sigma = measurements.sigma / np.sqrt(weight)[:, None]
    return replace(problem, measurements=replace(measurements, sigma=sigma))


def whitened_residuals(problem: Problem, mode: Mode) -> Float[np.ndarray, "obs 2"]:
    """Return measured minus predicted over sigma at a mode, in working order."""
    residuals = [of_slots(c.residual) for c in linearised_chunks(problem, mode.theta, mode.sources)]
    return np.concatenate(residuals)[problem.measurements.tiles.place]


def _outliers(problem: Problem, mode: Mode, found: Bool[np.ndarray, " obs"]) -> Outliers:
    if mode.reduced is None or not found.any():
        return Outliers(found, np.empty((0, 2)), np.empty(0), np.empty((0, 2)))
    outlier_problem = of_rows(problem, found)
    place = outlier_problem.measurements.tiles.place
    whitened, jacobian = [], []
    for chunk in linearised_chunks(outlier_problem, mode.theta, mode.sources):
        whitened.append(of_slots(chunk.residual))
        jacobian.append(np.stack([of_slots(pair) for pair in chunk.source], axis=-1))
    residual, by_source = np.concatenate(whitened)[place], np.concatenate(jacobian)[place]
    covariance = marginal_covariance(mode.reduced)[outlier_problem.measurements.index.source]
    # One more measurement of a source moves it by gain times residual.
    spread = by_source @ covariance @ by_source.swapaxes(1, 2) + np.eye(2)
    gain = covariance @ by_source.swapaxes(1, 2) @ np.linalg.inv(spread)
    moved = np.einsum("oab,ob->oa", gain, residual)
    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return Outliers(
        found,
        residual * outlier_problem.measurements.sigma,
        np.sqrt((residual**2).sum(axis=1)),
        moved / sigma,
    )
