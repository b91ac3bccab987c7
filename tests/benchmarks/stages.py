"""What the benchmarks time: the parts of a fit, each as work without arguments."""

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from solver.carry import parts_by_detector
from solver.gauss_newton import find_mode
from solver.instrument import MINI_MOCK
from solver.orbit import OrbitData
from solver.problem import Problem, build_problem
from solver.schur import Reduced
from solver.settings import FitSettings
from solver.what_if import carried, re_solve

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


def what_if(data: OrbitData, before: FitSettings, after: FitSettings) -> Callable[[], object]:
    """Return the re-solution of one change, from a fit made and a problem built beforehand."""
    solved = build_problem(data, MINI_MOCK, before)
    changed = build_problem(after.exclusions.without(data), MINI_MOCK, after)
    mode = find_mode(solved, before)
    # What follows the worker makes while nobody waits: `OrbitFitter.get_ready`.
    parts = parts_by_detector(mode.equations, solved) if after.exclusions.detectors else []
    if after.order < before.order:
        lower = build_problem(data, MINI_MOCK, before.with_(order=after.order))
        lowered = carried(mode, solved, lower)
        if lowered is None:
            sys.exit(f"no lower order than that of {before}")
        solved, mode = lower, lowered

    def work() -> object:
        found = re_solve(mode, solved, changed, after, parts)
        if found is None or found.reduced is None:
            sys.exit(f"no re-solution from {before} to {after}")
        return marginal_sigmas(found.reduced)

    return work


def marginal_sigmas(reduced: Reduced) -> object:
    return reduced.marginal_covariance(reduced.spread())
