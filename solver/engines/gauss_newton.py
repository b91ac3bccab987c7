"""The gauss-newton engine: the exact posterior mode in a few steps.

Each iteration solves the linearised model with the sources eliminated and takes the full
step, which is halved until the posterior's chi2 does not rise. The gradient is exact at every
point; the Jacobians are reused while the steps stay small. The fit has converged when every
step is below the tolerance times the uncertainty of its parameter.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.attitude_start import attitude_start
from solver.engines.jacobian_reuse import JacobianReuse
from solver.linear.chi2 import Gradient, gradient
from solver.linear.normal_equations import NormalEquations, accumulate
from solver.linear.source_elimination import ReducedSystem, eliminate_sources
from solver.problem.problem import Problem, thinned
from solver.runtime.threads import one_blas_thread

_MIN_STEP_FRACTION = 1e-6
# Fits of more sources than this start from a fit of about this many of them, to a tolerance
# of this many sigmas, which replaces a step of the full fit at a fraction of its cost.
_ROUGH_SOURCES = 1000
_ROUGH_TOLERANCE = 1e4
# Relative rounding error of chi2; a smaller rise is ignored.
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
    """The posterior mode, or the last point of a fit that failed.

    `theta` and `sources` are offsets from the origins; `reduced` is the posterior
    factorised at the last linearisation point, and `equations` are those of the data there.
    """

    theta: Float[np.ndarray, " calib"]
    sources: Float[np.ndarray, "src 2"]
    reduced: ReducedSystem | None
    status: FitStatus
    trace: list[Iteration]
    equations: NormalEquations


class StartingPoint(NamedTuple):
    """Offsets from the origins at which a fit starts."""

    theta: Float[np.ndarray, " calib"]
    sources: Float[np.ndarray, "src 2"]


class _Point(NamedTuple):
    theta: Float[np.ndarray, " calib"]
    sources: Float[np.ndarray, "src 2"]
    gradient: Gradient
    objective: float


class _Trace:
    """The rows of the trace, each reported when it is added."""

    def __init__(self, progress: Callable[[Iteration], None], begin: float) -> None:
        """Begin without rows; `begin` is when the fit began, by `time.perf_counter`."""
        self.rows: list[Iteration] = []
        self._progress, self._begin = progress, begin

    def add(self, point: _Point, largest: float, parameter: str, damping: float) -> None:
        """Add the row of a point, and of the step that led there."""
        seconds = time.perf_counter() - self._begin
        numbers = point.objective, point.gradient.chi2, largest, parameter, damping, seconds
        self.rows.append(Iteration(len(self.rows), *numbers))
        self._progress(self.rows[-1])


@one_blas_thread()
def find_mode(
    problem: Problem,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
    start: Mode | StartingPoint | NormalEquations | None = None,
) -> Mode:
    """Find the posterior mode, starting at the origins of all parameters.

    Parameters
    ----------
    progress : called after every iteration; an exception it raises stops the fit
    start : another point to start from, of a problem with the same parameters, or the equations of
        this problem near its mode
    """
    begin = time.perf_counter()
    if isinstance(start, NormalEquations):
        return _iterate(problem, settings, start, progress, begin)
    if start is not None:
        equations = _starting_at(problem, start.theta, start.sources)
        return _iterate(problem, settings, equations, progress, begin)
    sources, is_sampled = np.zeros((problem.n_src, 2)), _rough_sample(problem)
    sample = problem if is_sampled.all() else thinned(problem, is_sampled)
    equations = _starting_at(sample, np.zeros(problem.layout.size), sources[is_sampled])
    if sample is not problem:
        theta, _ = equations.at
        rough = replace(settings, tolerance=max(settings.tolerance, _ROUGH_TOLERANCE))
        mode = _iterate(sample, rough, equations, lambda _: None, begin)
        if mode.status is FitStatus.CONVERGED:
            theta, sources[is_sampled] = mode.theta, mode.sources
        equations = accumulate(problem, theta, sources)
    return _iterate(problem, settings, equations, progress, begin)


def _starting_at(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> NormalEquations:
    """Linearise at a point, or at the attitudes that the measurements imply if it is far off."""
    equations = accumulate(problem, theta, sources)
    moved = attitude_start(problem, theta, sources, equations.gradient.chi2)
    if moved is theta:
        return equations
    before, after = (
        objective(problem, at, sources, found)
        for at, found in (
            (theta, equations.gradient),
            (moved, gradient(problem, moved, sources)),
        )
    )
    return accumulate(problem, moved, sources) if after < before else equations


def _rough_sample(problem: Problem) -> Bool[np.ndarray, " src"]:
    """Return the sources of the rough fit: the reference sources and a sample of the others."""
    stride = max(problem.n_src // _ROUGH_SOURCES, 1)
    return (np.arange(problem.n_src) % stride == 0) | problem.sources["is_reference"].to_numpy(bool)


def _iterate(
    problem: Problem,
    settings: FitSettings,
    equations: NormalEquations,
    progress: Callable[[Iteration], None],
    begin: float,
) -> Mode:
    """Iterate from the point of `equations`; `begin` is when the fit began."""
    trace = _Trace(progress, begin)

    def end(point: _Point, reduced: ReducedSystem | None, status: FitStatus) -> Mode:
        return Mode(point.theta, point.sources, reduced, status, trace.rows, equations)

    point = _point(problem, *equations.at, equations.gradient)
    trace.add(point, float("nan"), "", 0.0)
    if not np.isfinite(point.objective):
        return end(point, None, FitStatus.NOT_FINITE)
    reduced, reuse = eliminate_sources(equations, problem.priors), JacobianReuse()
    while True:
        if reduced is None:
            return end(point, None, FitStatus.SINGULAR)
        step = reduced.solve(*downhill(problem, *point[:3]))
        largest, parameter = largest_step(problem, step, reduced)
        if reuse.needs_exact(largest, settings.tolerance):
            # Freed first, because they are large and reusing memory is faster than allocating it.
            del equations, reduced
            equations = accumulate(problem, point.theta, point.sources)
            reduced, reuse = eliminate_sources(equations, problem.priors), JacobianReuse()
            continue
        if largest < settings.tolerance:
            point = point._replace(theta=point.theta + step[0], sources=point.sources + step[1])
            trace.add(point, largest, parameter, 0.0)
            return end(point, reduced, FitStatus.CONVERGED)
        if len(trace.rows) > settings.max_iterations:
            return end(point, reduced, FitStatus.MAX_ITERATIONS)
        moved, damping = _descend(problem, point, step)
        if moved is None:
            return end(point, reduced, FitStatus.STUCK)
        point, reuse = moved, JacobianReuse.after(largest, problem.layout.n_walk > 0)
        trace.add(point, largest, parameter, damping)


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
    """Return the posterior's chi2: that of the data plus the penalty of the priors."""
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
    """Take the step, halved until the objective does not rise.

    The step points downhill, so a short enough fraction of it always succeeds.
    """
    fraction = 1.0
    while fraction > _MIN_STEP_FRACTION:
        theta, sources = point.theta + fraction * step[0], point.sources + fraction * step[1]
        moved = _point(problem, theta, sources, gradient(problem, theta, sources))
        if moved.objective <= point.objective * (1.0 + _ROUNDING):
            return moved, 1.0 - fraction
        fraction *= 0.5
    return None, 1.0 - fraction


def largest_step(
    problem: Problem,
    step: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]],
    reduced: ReducedSystem,
) -> tuple[float, str]:
    """Return the largest ratio of step to uncertainty, and the parameter's name.

    Uncertainties are marginal for the calibration. For the sources they are conditional:
    smaller by a few per cent, but available at no cost.
    """
    theta_step, source_step = (
        np.abs(moved) / sigma for moved, sigma in zip(step, reduced.sigmas, strict=True)
    )
    if theta_step.max() > source_step.max():
        column = int(theta_step.argmax())
        return float(theta_step[column]), _parameter_name(problem, column)
    source = int(source_step.max(axis=1).argmax())
    return float(source_step.max()), f"source {problem.sources['source_id'].iloc[source]}"


def _parameter_name(problem: Problem, column: int) -> str:
    for group in problem.layout.groups:
        place = np.flatnonzero(problem.layout.columns(group) == column)
        if len(place):
            return f"{group.label} [{problem.elements[group.axis][place[0]].name}]"
    raise IndexError(f"no calibration parameter in column {column}")
