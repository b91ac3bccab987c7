"""The gauss-newton engine: the exact posterior mode in a few steps.

Each iteration linearises the model exactly, eliminates the sources and takes the full
step, or half of it, or a quarter, if the posterior's chi2 would rise. The fit has converged when
every step is below the tolerance times the uncertainty of its parameter, which is what
"nothing changes any more" means to somebody who reads the result.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from solver.normal import NormalEquations, accumulate
from solver.parameters import CALIBRATION_GROUPS
from solver.problem import Problem
from solver.result import FitStatus
from solver.schur import Reduced, reduce
from solver.settings import FitSettings

_SMALLEST_SHARE = 1e-6
# Rounding moves chi2 by about this fraction; a rise below it is none.
_ROUNDING = 1e-9


class Iteration(NamedTuple):
    """One row of the trace, `schema.TRACE`."""

    iteration: int
    objective: float
    chi2: float
    largest_step: float
    largest_parameter: str
    damping: float
    seconds: float


class Mode(NamedTuple):
    """Where the engine ended.

    `theta` and `sources` are offsets from the origins; `reduced` is the posterior
    factorised at the last linearisation point, which lies within one
    converged step.
    """

    theta: Float[np.ndarray, " calib"]
    sources: Float[np.ndarray, "src 2"]
    reduced: Reduced | None
    status: FitStatus
    trace: list[Iteration]


class _Point(NamedTuple):
    theta: Float[np.ndarray, " calib"]
    sources: Float[np.ndarray, "src 2"]
    equations: NormalEquations
    objective: float


def find_mode(
    problem: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
) -> Mode:
    """Find the posterior mode from the origins of all parameters.

    Parameters
    ----------
    progress : called after every iteration; what it raises stops the fit
    """
    start = time.perf_counter()
    trace: list[Iteration] = []

    def report(point: _Point, largest: float, parameter: str, damping: float) -> None:
        elapsed = time.perf_counter() - start
        chi2 = point.equations.chi2
        trace.append(
            Iteration(len(trace), point.objective, chi2, largest, parameter, damping, elapsed)
        )
        progress(trace[-1])

    point = _evaluate(problem, np.zeros(problem.layout.size), np.zeros((problem.n_src, 2)))
    report(point, float("nan"), "", 0.0)
    if not np.isfinite(point.objective):
        return Mode(point.theta, point.sources, None, FitStatus.NOT_FINITE, trace)
    while True:
        reduced = reduce(point.equations, problem.priors, point.theta, point.sources)
        if reduced is None:
            return Mode(point.theta, point.sources, None, FitStatus.SINGULAR, trace)
        step = reduced.step()
        largest, parameter = _largest(problem, step, reduced)
        if largest < settings.tolerance:
            point = point._replace(theta=point.theta + step[0], sources=point.sources + step[1])
            report(point, largest, parameter, 0.0)
            return Mode(point.theta, point.sources, reduced, FitStatus.CONVERGED, trace)
        if len(trace) > settings.max_iterations:
            return Mode(point.theta, point.sources, reduced, FitStatus.MAX_ITERATIONS, trace)
        moved, damping = _descend(problem, point, step)
        if moved is None:
            return Mode(point.theta, point.sources, reduced, FitStatus.STUCK, trace)
        point = moved
        report(point, largest, parameter, damping)


def _evaluate(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> _Point:
    equations = accumulate(problem, theta, sources)
    objective = equations.chi2 + problem.priors.penalty(theta, sources)
    return _Point(theta, sources, equations, objective)


def _descend(
    problem: Problem,
    point: _Point,
    step: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]],
) -> tuple[_Point | None, float]:
    """Take the step, or as much of it as it takes for the objective not to rise.

    The step points downhill, so that a short enough part of it always does.
    """
    share = 1.0
    while share > _SMALLEST_SHARE:
        moved = _evaluate(problem, point.theta + share * step[0], point.sources + share * step[1])
        if moved.objective <= point.objective * (1.0 + _ROUNDING):
            return moved, 1.0 - share
        share *= 0.5
    return None, 1.0 - share


def _largest(
    problem: Problem,
    step: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]],
    reduced: Reduced,
) -> tuple[float, str]:
    """Return the largest step over its uncertainty, and the parameter's name.

    Marginal uncertainties for the calibration; for the sources the conditional ones,
    which are smaller by a few per cent and cost nothing.
    """
    of_theta = np.abs(step[0]) / np.sqrt(np.diag(reduced.theta_covariance()))
    variances = np.diagonal(reduced.conditional_covariance(), axis1=1, axis2=2)
    of_sources = np.abs(step[1]) / np.sqrt(variances)
    if of_theta.max() > of_sources.max():
        column = int(of_theta.argmax())
        return float(of_theta[column]), _name_of(problem, column)
    source = int(of_sources.max(axis=1).argmax())
    return float(of_sources.max()), f"source {problem.sources['source_id'].iloc[source]}"


def _name_of(problem: Problem, column: int) -> str:
    for group in CALIBRATION_GROUPS:
        place = np.flatnonzero(problem.layout.columns(group) == column)
        if len(place):
            return f"{group.label} [{place[0]}]"
    raise IndexError(f"no calibration parameter in column {column}")
