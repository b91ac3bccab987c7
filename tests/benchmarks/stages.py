"""What the benchmarks time: the parts of a fit, each as work without arguments."""

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from solver.gauss_newton import Mode, find_mode
from solver.instrument import MINI_MOCK
from solver.orbit import OrbitData
from solver.problem import Problem, build_problem
from solver.schur import Reduced
from solver.settings import FitSettings
from solver.what_if import linearised, re_solve

UNIT_REPEATS = 5


def unit_product(problem: Problem) -> Callable[[], object]:
    """Return the product whose time is one unit."""
    shape = (2 * problem.n_src, problem.layout.size)
    matrix = np.random.default_rng(0).standard_normal(shape)
    return lambda: matrix.T @ matrix


def fit_with_sigmas(problem: Problem, settings: FitSettings) -> object:
    # A problem of its own, whose tiles are still to be laid.
    reduced = find_mode(replace(problem), settings).reduced
    return None if reduced is None else marginal_sigmas(reduced)


def what_if(
    data: OrbitData, before: FitSettings, after: FitSettings, made_ready: FitSettings | None = None
) -> Callable[[], object]:
    """Return the re-solution of one change, from a fit made and a problem built beforehand.

    Parameters
    ----------
    made_ready : from which the worker starts instead, as it prepares it while nobody waits
    """
    solved = build_problem(data, MINI_MOCK, before)
    mode = find_mode(solved, before)
    if made_ready is not None:
        near = build_problem(made_ready.exclusions.without(data), MINI_MOCK, made_ready)
        found = re_solve(mode, solved, near, made_ready) or find_mode(near, made_ready)
        mode, solved = linearised(near, found), near
    changed = build_problem(after.exclusions.without(data), MINI_MOCK, after)

    def work() -> object:
        reduced = _re_solved(mode, solved, changed, after).reduced
        return None if reduced is None else marginal_sigmas(reduced)

    return work


def _re_solved(mode: Mode, solved: Problem, changed: Problem, settings: FitSettings) -> Mode:
    found = re_solve(mode, solved, changed, settings)
    if found is None:
        sys.exit(f"no re-solution for {settings}")
    return found


def marginal_sigmas(reduced: Reduced) -> object:
    return reduced.marginal_covariance()
