"""The gauss-newton engine: the exact posterior mode in a few steps.

Each iteration solves the linearised model with the sources eliminated and takes the full
step, or half of it, or a quarter, if the posterior's chi2 would rise. The gradient is exact
at every point; the Jacobians are made anew as soon as those before give no small step. The
fit has converged when every step is below the tolerance times the uncertainty of its
parameter, which is what "nothing changes any more" means to somebody who reads the result.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from solver.data.parameters import CALIBRATION_GROUPS
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.linear.chi2 import Gradient, gradient
from solver.linear.normal_equations import NormalEquations, accumulate
from solver.linear.source_elimination import ReducedSystem, eliminate_sources
from solver.problem.problem import Problem, thinned

_SMALLEST_SHARE = 1e-6
# The Jacobians are kept as long as they give steps of at most so many sigmas, each so much
# smaller than the one before. More would not do: what pointings and detectors have in common
# is held by the priors alone, and in that direction the smallest change of the Jacobians is
# amplified by its uncertainty.
_KEEP_BELOW = 1.0
_KEEP_SHRINKING = 0.1
# Fits of more sources than this start from a fit of about so many of them, done to within
# some sigmas of its own, which is as good as a step of the whole at a fraction of its cost.
_ROUGH_SOURCES = 1000
_ROUGH_TOLERANCE = 1e4
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
    factorised at the last linearisation point, and `equations` those of the data there.
    """

    theta: Float[np.ndarray, " calib"]
    sources: Float[np.ndarray, "src 2"]
    reduced: ReducedSystem | None
    status: FitStatus
    trace: list[Iteration]
    equations: NormalEquations


class _Point(NamedTuple):
    theta: Float[np.ndarray, " calib"]
    sources: Float[np.ndarray, "src 2"]
    gradient: Gradient
    objective: float


def find_mode(
    problem: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
    start: Mode | None = None,
) -> Mode:
    """Find the posterior mode from the origins of all parameters.

    Parameters
    ----------
    progress : called after every iteration; what it raises stops the fit
    start : where to begin instead, of a problem with the same parameters
    """
    begin = time.perf_counter()
    if start is not None:
        equations = accumulate(problem, start.theta, start.sources)
        return _iterate(problem, settings, equations, progress, begin)
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    few = _rough_selection(problem)
    if not few.all():
        rough = replace(settings, tolerance=max(settings.tolerance, _ROUGH_TOLERANCE))
        part = thinned(problem, few)
        at_origin = accumulate(part, theta, sources[few])
        mode = _iterate(part, rough, at_origin, lambda _: None, begin)
        if mode.status is FitStatus.CONVERGED:
            theta, sources[few] = mode.theta, mode.sources
    return _iterate(problem, settings, accumulate(problem, theta, sources), progress, begin)


def _rough_selection(problem: Problem) -> Bool[np.ndarray, " src"]:
    """Return the sources to start with: the reference stars and a share of the others."""
    every = max(problem.n_src // _ROUGH_SOURCES, 1)
    return (np.arange(problem.n_src) % every == 0) | problem.sources["is_reference"].to_numpy(bool)


def _iterate(
    problem: Problem,
    settings: FitSettings,
    equations: NormalEquations,
    progress: Callable[[Iteration], None],
    begin: float,
) -> Mode:
    trace: list[Iteration] = []

    def report(point: _Point, largest: float, parameter: str, damping: float) -> None:
        elapsed = time.perf_counter() - begin
        chi2 = point.gradient.chi2
        trace.append(
            Iteration(len(trace), point.objective, chi2, largest, parameter, damping, elapsed)
        )
        progress(trace[-1])

    def end(point: _Point, reduced: ReducedSystem | None, status: FitStatus) -> Mode:
        return Mode(point.theta, point.sources, reduced, status, trace, equations)

    point = _point(problem, *equations.at, equations.gradient)
    report(point, float("nan"), "", 0.0)
    if not np.isfinite(point.objective):
        return end(point, None, FitStatus.NOT_FINITE)
    reduced, limit = eliminate_sources(equations, problem.priors), np.inf
    while True:
        if reduced is None:
            return end(point, None, FitStatus.SINGULAR)
        step = reduced.solve(*downhill(problem, *point[:3]))
        largest, parameter = largest_step(problem, step, reduced)
        if largest > limit:
            # Given back first: they are large, and memory that was in use is quicker than fresh.
            del equations, reduced
            equations = accumulate(problem, point.theta, point.sources)
            reduced, limit = eliminate_sources(equations, problem.priors), np.inf
            continue
        if largest < settings.tolerance:
            point = point._replace(theta=point.theta + step[0], sources=point.sources + step[1])
            report(point, largest, parameter, 0.0)
            return end(point, reduced, FitStatus.CONVERGED)
        if len(trace) > settings.max_iterations:
            return end(point, reduced, FitStatus.MAX_ITERATIONS)
        moved, damping = _descend(problem, point, step)
        if moved is None:
            return end(point, reduced, FitStatus.STUCK)
        point, limit = moved, min(_KEEP_BELOW, _KEEP_SHRINKING * largest)
        report(point, largest, parameter, damping)


def _point(
    problem: Problem,
    theta: Float[np.ndarray, " calib"],
    sources: Float[np.ndarray, "src 2"],
    at: Gradient,
) -> _Point:
    return _Point(theta, sources, at, objective(problem, theta, sources, at))


def objective(
    problem: Problem,
    theta: Float[np.ndarray, " calib"],
    sources: Float[np.ndarray, "src 2"],
    at: Gradient,
) -> float:
    """Return the posterior's chi2: the data's, and the priors' penalty."""
    return at.chi2 + problem.priors.penalty(theta, sources)


def downhill(
    problem: Problem,
    theta: Float[np.ndarray, " calib"],
    sources: Float[np.ndarray, "src 2"],
    at: Gradient,
) -> tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]:
    """Return minus the gradient of half the posterior's chi2."""
    by_theta = at.by_theta - problem.priors.gradient(theta)
    return by_theta, at.by_source - problem.priors.source_gradient(sources)


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
        theta, sources = point.theta + share * step[0], point.sources + share * step[1]
        moved = _point(problem, theta, sources, gradient(problem, theta, sources))
        if moved.objective <= point.objective * (1.0 + _ROUNDING):
            return moved, 1.0 - share
        share *= 0.5
    return None, 1.0 - share


def largest_step(
    problem: Problem,
    step: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]],
    reduced: ReducedSystem,
) -> tuple[float, str]:
    """Return the largest step over its uncertainty, and the parameter's name.

    Marginal uncertainties for the calibration; for the sources the conditional ones,
    which are smaller by a few per cent and cost nothing.
    """
    of_theta, of_sources = (
        np.abs(moved) / sigma for moved, sigma in zip(step, reduced.sigmas, strict=True)
    )
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
