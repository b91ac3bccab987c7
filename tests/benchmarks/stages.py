"""The stages of a fit that the benchmarks time, as functions without arguments."""

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from solver.data.instrument import MINI_MOCK
from solver.data.orbit import OrbitData
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Mode, find_mode
from solver.engines.what_if import linearised, solve_what_if
from solver.linear.covariances import marginal_covariance
from solver.problem.problem import Problem
from solver.problem.problem_cache import ProblemCache

UNIT_REPEATS = 5


def unit_product(problem: Problem) -> Callable[[], object]:
    """Return the matrix product whose time is one unit."""
    shape = (2 * problem.n_src, problem.layout.size)
    matrix = np.random.default_rng(0).standard_normal(shape)
    return lambda: matrix.T @ matrix


def fit_with_sigmas(problem: Problem, settings: FitSettings) -> object:
    reduced = find_mode(_as_new(problem), settings).reduced
    return None if reduced is None else marginal_covariance(reduced)


def what_if(
    data: OrbitData, before: FitSettings, after: FitSettings, precomputed: FitSettings | None = None
) -> Callable[[], object]:
    """Return the what-if of one change; the fit and the changed problem are made beforehand.

    Parameters
    ----------
    precomputed : settings of a warm start that the solver process precomputes while idle
    """
    cache = ProblemCache(data, MINI_MOCK)
    _, solved = cache.get(before)
    mode = find_mode(solved, before)
    if precomputed is not None:
        _, lower = cache.get(precomputed)
        found = solve_what_if(mode, solved, lower, precomputed) or find_mode(lower, precomputed)
        mode, solved = linearised(lower, found), lower
    _, changed = cache.get(after)
    is_same = changed.measurements is solved.measurements

    def work() -> object:
        # Tiles exist for the same measurements and have to be arranged for others.
        target = changed if is_same else _as_new(changed)
        reduced = _what_if(mode, solved, target, after).reduced
        return None if reduced is None else marginal_covariance(reduced)

    return work


def _as_new(problem: Problem) -> Problem:
    """Return a copy of a problem without arranged tiles."""
    return replace(problem, measurements=replace(problem.measurements))


def _what_if(mode: Mode, solved: Problem, changed: Problem, settings: FitSettings) -> Mode:
    found = solve_what_if(mode, solved, changed, settings)
    if found is None:
        sys.exit(f"no what-if for {settings}")
    return found
