"""Robust fitting: outliers are found by a heavy-tailed likelihood, and left out.

Under Student's t a measurement weighs the less the farther it lies from its prediction, so
that a few bad ones draw the solution hardly at all. What is then farther away than any of
as many good ones would be is an outlier; the others are fitted as if it had not been
measured, with a normal likelihood, for which uncertainties and diagnostics are exact.
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
from solver.linear.leverage import of_slots
from solver.linear.normal_equations import chunks
from solver.problem.problem import Problem, of_rows

# Degrees of freedom: few, so that outliers weigh next to nothing.
_NU = 4.0
# The weights have settled when none changes by more than this, or after so many rounds.
_SETTLED = 1e-3
_MAX_ROUNDS = 30
# So many good measurements are taken for outliers in an orbit, on average.
_FALSE_ALARMS = 0.01


class Outliers(NamedTuple):
    """The measurements that do not belong to the others, in working order.

    Attributes
    ----------
    found : of every measurement, whether it is one
    residual : measured minus predicted, pixels
    distance : that over its uncertainty, both coordinates together
    shift : of its source in alpha* and delta, if it were used, over the marginal sigma
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
    """Fit with Student's t and return what lies too far away.

    Returns
    -------
    None if the problem has no solution; the fit of the rest will say why.
    """
    mode = find_mode(problem, settings, progress)
    weight = np.ones(problem.n_obs)
    for _ in range(_MAX_ROUNDS):
        if mode.reduced is None:
            return None
        squares = (_whitened(problem, mode) ** 2).sum(axis=1)
        before, weight = weight, (_NU + 2.0) / (_NU + squares)
        if np.abs(weight - before).max() < _SETTLED:
            break
        mode = find_mode(_weighted(problem, weight), settings, progress, start=mode)
    # Of a good measurement the square is exponential with mean two.
    limit = 2.0 * np.log(problem.n_obs / _FALSE_ALARMS)
    found = squares > limit
    return _described(problem, mode, found)


def outlier_table(
    outliers: Outliers | None, problem: Problem, data: OrbitData
) -> pd.DataFrame | None:
    """Return `schema.OUTLIERS`, the farthest first, labelled as the measurements are.

    Parameters
    ----------
    data : what the problem was built from
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


def _whitened(problem: Problem, mode: Mode) -> Float[np.ndarray, "obs 2"]:
    parts = [of_slots(c.residual) for c in chunks(problem, mode.theta, mode.sources)]
    return np.concatenate(parts)[problem.measurements.tiles.place]


def _described(problem: Problem, mode: Mode, found: Bool[np.ndarray, " obs"]) -> Outliers:
    if mode.reduced is None or not found.any():
        return Outliers(found, np.empty((0, 2)), np.empty(0), np.empty((0, 2)))
    few = of_rows(problem, found)
    place = few.measurements.tiles.place
    whitened, jacobian = [], []
    for chunk in chunks(few, mode.theta, mode.sources):
        whitened.append(of_slots(chunk.residual))
        jacobian.append(np.stack([of_slots(pair) for pair in chunk.source], axis=-1))
    residual, by_source = np.concatenate(whitened)[place], np.concatenate(jacobian)[place]
    covariance = mode.reduced.marginal_covariance()[few.measurements.index.source]
    # As one more measurement of the source moves it: gain times residual.
    spread = by_source @ covariance @ by_source.swapaxes(1, 2) + np.eye(2)
    gain = covariance @ by_source.swapaxes(1, 2) @ np.linalg.inv(spread)
    moved = np.einsum("oab,ob->oa", gain, residual)
    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return Outliers(
        found, residual * few.measurements.sigma, np.sqrt((residual**2).sum(axis=1)), moved / sigma
    )
