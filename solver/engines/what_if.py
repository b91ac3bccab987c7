"""What-if: the solution under other priors, a lower order or less data, without a refit.

The posterior is nearly Gaussian about its mode, so the final normal equations of a fit, updated
for the changed problem, give its solution in one step. Along the directions that only priors
constrain, common to pointings and detectors, this step is so long that the other parameters need
a correction: one or two short steps with the same Jacobians and the exact gradient. Their length
shows whether the first step was short enough for a linear model.
"""

import time

import numpy as np

from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Iteration, Mode, downhill, largest_step, objective
from solver.linear.chi2 import gradient
from solver.linear.source_elimination import POORLY_CONSTRAINED, eliminate_sources
from solver.linear.update import update_equations
from solver.problem.problem import Problem
from solver.runtime.threads import one_blas_thread

# Maximum number of steps; a nearly linear model needs fewer.
_MAX_STEPS = 5
# Number of the step that keeps poorly constrained directions fixed, after the first, long one.
_CORRECTION_STEP = 2


def _updated(mode: Mode, solved: Problem, changed: Problem) -> Mode | None:
    """Return the posterior of a changed problem, linearised at the same point as `solved`.

    Returns
    -------
    None if `solved` lacks measurements or terms of `changed`, or if `changed` is singular.
    """
    equations = update_equations(mode.equations, solved, changed)
    if equations is None:
        return None
    # If only the priors have changed, the blocks of the data are the same objects.
    before = mode.reduced if equations.cross is mode.equations.cross else None
    reduced = eliminate_sources(equations, changed.priors, before)
    if reduced is None:
        return None
    return Mode(*equations.at, reduced, FitStatus.WHAT_IF, [], equations)


@one_blas_thread()
def solve_what_if(
    mode: Mode,
    solved: Problem,
    changed: Problem,
    settings: FitSettings,
    longest: float = np.inf,
) -> Mode | None:
    """Return the mode of a changed problem, from the mode of a solved one.

    Parameters
    ----------
    mode : solution of `solved`, with normal equations near it
    settings : settings of `changed`
    longest : maximum length of the first step, sigma

    Returns
    -------
    None if a refit is needed: `changed` has more data or terms than `solved`, or differs so
    much that the model is not linear in between.
    """
    begin = time.perf_counter()
    start = _updated(mode, solved, changed)
    if start is None or start.reduced is None:
        return None
    theta, sources, reduced, trace = start.theta, start.sources, start.reduced, start.trace
    at, weak, limit = start.equations.gradient, None, longest
    largest, parameter = float("nan"), ""
    while len(trace) <= _MAX_STEPS:
        total, elapsed = objective(changed, theta, sources, at), time.perf_counter() - begin
        trace.append(Iteration(len(trace), total, at.chi2, largest, parameter, 0.0, elapsed))
        if largest < settings.tolerance:
            return Mode(theta, sources, reduced, FitStatus.WHAT_IF, trace, start.equations)
        right = downhill(changed, theta, sources, at)
        step = reduced.solve(*right, weak)
        largest, parameter = largest_step(changed, step, reduced)
        if largest > limit:
            return None
        if len(trace) == _CORRECTION_STEP and largest >= settings.tolerance:
            # Errors of the old Jacobians are amplified most along poorly constrained directions.
            # These stay where the first step put them until the other parameters are corrected.
            # They follow in the next step, which may be longer than this one, not than the first.
            step = reduced.solve(*right, reduced.weak_directions(POORLY_CONSTRAINED))
        else:
            # The next step corrects this one and may be at most 10 % longer.
            limit = 1.1 * largest
        theta, sources = theta + step[0], sources + step[1]
        if largest >= settings.tolerance:
            at = gradient(changed, theta, sources)
        weak = reduced.weak_directions() if weak is None else weak
    return None
