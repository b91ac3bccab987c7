"""What the benchmarks time: the parts of a fit, each as work without arguments."""

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from solver.data.instrument import MINI_MOCK
from solver.data.orbit import OrbitData
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Mode, find_mode
from solver.engines.what_if import linearised, solve_what_if
from solver.linear.source_elimination import ReducedSystem
from solver.problem.problem import Problem
from solver.problem.problem_cache import ProblemCache

UNIT_REPEATS = 5


def unit_product(problem: Problem) -> Callable[[], object]:
    """Return the product whose time is one unit."""
    shape = (2 * problem.n_src, problem.layout.size)
    matrix = np.random.default_rng(0).standard_normal(shape)
    return lambda: matrix.T @ matrix


def fit_with_sigmas(problem: Problem, settings: FitSettings) -> object:
    reduced = find_mode(_as_new(problem), settings).reduced
    return None if reduced is None else marginal_sigmas(reduced)


def what_if(
    data: OrbitData, before: FitSettings, after: FitSettings, made_ready: FitSettings | None = None
) -> Callable[[], object]:
    """Return the re-solution of one change, from a fit made and a problem built beforehand.

    Parameters
    ----------
    made_ready : from which the worker starts instead, as it prepares it while nobody waits
    """
    selection = ProblemCache(data, MINI_MOCK)
    _, solved = selection.choose(before)
    mode = find_mode(solved, before)
    if made_ready is not None:
        _, near = selection.choose(made_ready)
        found = solve_what_if(mode, solved, near, made_ready) or find_mode(near, made_ready)
        mode, solved = linearised(near, found), near
    _, changed = selection.choose(after)
    is_same = changed.measurements is solved.measurements

    def work() -> object:
        # The tiles of the same measurements are laid, and those of others are not.
        asked = changed if is_same else _as_new(changed)
        reduced = _what_if(mode, solved, asked, after).reduced
        return None if reduced is None else marginal_sigmas(reduced)

    return work


def _as_new(problem: Problem) -> Problem:
    """Return a problem whose tiles are still to be laid."""
    return replace(problem, measurements=replace(problem.measurements))


def _what_if(mode: Mode, solved: Problem, changed: Problem, settings: FitSettings) -> Mode:
    found = solve_what_if(mode, solved, changed, settings)
    if found is None:
        sys.exit(f"no re-solution for {settings}")
    return found


def marginal_sigmas(reduced: ReducedSystem) -> object:
    return reduced.marginal_covariance()
