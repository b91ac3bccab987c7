"""The stages of a fit that the benchmarks time, as functions without arguments."""

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from solver.data.instrument import MINI_MOCK
from solver.data.orbit import OrbitData
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import find_mode
from solver.engines.warm_starts import WarmStart, WarmStarts
from solver.linear.covariances import marginal_covariance
from solver.problem.problem import Problem
from solver.problem.problem_cache import ProblemCache

UNIT_REPEATS = 9


def unit_product(problem: Problem) -> Callable[[], object]:
    """Return the matrix product whose time is one unit."""
    shape = (2 * problem.n_src, problem.layout.size)
    matrix = np.random.default_rng(0).standard_normal(shape)
    return lambda: matrix.T @ matrix


def fit_with_sigmas(problem: Problem, settings: FitSettings) -> object:
    reduced = find_mode(_as_new(problem), settings).reduced
    return None if reduced is None else marginal_covariance(reduced)


def what_if(
    data: OrbitData, before: FitSettings, after: FitSettings, *, is_prepared: bool = False
) -> Callable[[], object]:
    """Return the what-if of one change; the fit and the changed problem are made beforehand.

    Parameters
    ----------
    is_prepared : whether a lower order is precomputed, as the solver process does while idle
    """
    cache = ProblemCache(data, MINI_MOCK)
    _, solved = cache.get(before)
    fit = WarmStart(before, solved, find_mode(solved, before))
    prepared = WarmStarts(fit, lambda other: cache.get(other)[1])
    prepared.add(after.order)
    _, changed = cache.get(after)
    is_same = changed.measurements is solved.measurements

    def work() -> object:
        starts = prepared if is_prepared else WarmStarts(fit, lambda other: cache.get(other)[1])
        # Tiles exist for the same measurements and have to be arranged for others.
        found = starts.solution(changed if is_same else _as_new(changed), after)
        if found is None:
            sys.exit(f"no what-if for {after}")
        return None if found.reduced is None else marginal_covariance(found.reduced)

    return work


def _as_new(problem: Problem) -> Problem:
    """Return a copy of a problem without arranged tiles."""
    return replace(problem, measurements=replace(problem.measurements))
