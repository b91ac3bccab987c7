"""What if: the solution under other priors, a lower order or less data, without a refit.

The posterior is all but Gaussian about its mode. So the normal equations that a fit ended
with, carried over to the changed problem, give its solution in one step. That step moves
what pointings and detectors have in common, which nothing but priors holds, so far that
the rest needs to follow: one or two short steps with the same Jacobians and the exact
gradient do that, and show whether the first was short enough for a linear model.
"""

import time

import numpy as np

from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Iteration, Mode, downhill, largest_step, objective
from solver.linear.chi2 import gradient
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import POORLY_CONSTRAINED, eliminate_sources
from solver.linear.update import update_equations
from solver.problem.problem import Problem

# Steps that are not small after so many are not those of a nearly linear model.
_MAX_STEPS = 5
# The one after the first, long one.
_CAREFUL_STEP = 2


def linearised(problem: Problem, mode: Mode) -> Mode:
    """Return a solution with normal equations of its own place: a start for further changes."""
    equations = accumulate(problem, mode.theta, mode.sources)
    return mode._replace(equations=equations, reduced=None)


def _carried(mode: Mode, solved: Problem, changed: Problem) -> Mode | None:
    """Return the posterior of a changed problem, linearised where that of `solved` was.

    Returns
    -------
    None if `solved` does not hold what `changed` asks for, or that is singular.
    """
    equations = update_equations(mode.equations, solved, changed)
    if equations is None:
        return None
    # None of the data's blocks is another where the priors alone have changed.
    before = mode.reduced if equations.cross is mode.equations.cross else None
    reduced = eliminate_sources(equations, changed.priors, before)
    if reduced is None:
        return None
    return Mode(*equations.at, reduced, FitStatus.WHAT_IF, [], equations)


def solve_what_if(
    mode: Mode, solved: Problem, changed: Problem, settings: FitSettings
) -> Mode | None:
    """Return the mode of a changed problem, from that of one that was solved.

    Parameters
    ----------
    mode : the solution of `solved`; the model is linear about its equations' place
    settings : those of `changed`

    Returns
    -------
    None if only a refit can tell: `changed` asks for more data or terms than `solved` had,
    or is so different that the model is not linear on the way.
    """
    begin = time.perf_counter()
    start = _carried(mode, solved, changed)
    if start is None or start.reduced is None:
        return None
    theta, sources, reduced, trace = start.theta, start.sources, start.reduced, start.trace
    at, held, limit = start.equations.gradient, None, np.inf
    largest, parameter = float("nan"), ""
    while len(trace) <= _MAX_STEPS:
        total, elapsed = objective(changed, theta, sources, at), time.perf_counter() - begin
        trace.append(Iteration(len(trace), total, at.chi2, largest, parameter, 0.0, elapsed))
        if largest < settings.tolerance:
            return Mode(theta, sources, reduced, FitStatus.WHAT_IF, trace, start.equations)
        right = downhill(changed, theta, sources, at)
        step = reduced.solve(*right, held)
        largest, parameter = largest_step(changed, step, reduced)
        if largest > limit:
            return None
        if len(trace) == _CAREFUL_STEP and largest >= settings.tolerance:
            # What the Jacobians have changed by since is amplified most where the data tell
            # least: so that stays, which the first step took to its place, until the rest is right.
            # It follows then, by more than this step perhaps, but by less than the first.
            step = reduced.solve(*right, reduced.weak_directions(POORLY_CONSTRAINED))
        else:
            # The second step puts right what the first left behind, and is shorter.
            limit = 1.1 * largest
        theta, sources = theta + step[0], sources + step[1]
        if largest >= settings.tolerance:
            at = gradient(changed, theta, sources)
        held = reduced.weak_directions() if held is None else held
    return None
