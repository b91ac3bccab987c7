"""The likely cause of a fit without a solution, where a fit itself would still find one."""

import numpy as np

from solver.data.instrument import MINI_MOCK
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Mode
from solver.engines.no_solution import likely_cause
from solver.linear.normal_equations import accumulate
from solver.problem.problem import build_problem
from tests.solver.small_orbit import make_orbit


def test_open_priors_are_not_taken_for_small_uncertainties():
    flat = dict.fromkeys(("focal_length", "detector_x", "detector_y", "distortion_x"), np.inf)
    problem = build_problem(make_orbit().data, MINI_MOCK, FitSettings(prior_widths=flat))
    at = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    mode = Mode(*at, None, FitStatus.SINGULAR, [], accumulate(problem, *at))
    cause = likely_cause(problem, mode)
    assert cause.name == "open-direction"
    assert "sx, sy" not in cause.words


def test_wrong_unit_of_the_focal_length_is_named():
    data = make_orbit().data
    data.exposures["focal_length"] *= 1e3
    problem = build_problem(data, MINI_MOCK, FitSettings())
    at = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    mode = Mode(*at, None, FitStatus.SINGULAR, [], accumulate(problem, *at))
    cause = likely_cause(problem, mode)
    assert "pixels from where they were measured" in cause.words
    assert "focal_length (um)" in cause.action
    assert cause.is_misfit
