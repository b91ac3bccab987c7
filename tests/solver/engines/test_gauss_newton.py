from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from solver.data.instrument import MINI_MOCK
from solver.data.parameters import BY_NAME
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import find_mode
from solver.errors import CancelledError
from solver.linear.chi2 import gradient
from solver.problem.problem import build_problem
from tests.solver.small_orbit import make_orbit


def problem_of(orbit, settings):
    return build_problem(orbit.data, orbit.instrument, settings)


def test_gradient_vanishes_at_the_mode(solution, make_dense):
    """The reference is the gradient of the dense model, in units of the uncertainties."""
    dense = make_dense(solution.problem, solution.mode.theta, solution.mode.sources)
    step = dense.covariance @ dense.gradient
    assert np.abs(step / np.sqrt(np.diag(dense.covariance))).max() < 1e-4


def test_displacements_from_the_mode_raise_the_penalised_chi2(solution):
    problem, mode = solution.problem, solution.mode
    rng = np.random.default_rng(3)

    def objective(theta, sources):
        return gradient(problem, theta, sources).chi2 + problem.priors.penalty(theta, sources)

    sigma = np.sqrt(np.diag(solution.covariance.theta))
    lowest = objective(mode.theta, mode.sources)
    assert lowest == pytest.approx(mode.trace[-1].objective, rel=1e-8)
    for _ in range(3):
        theta = mode.theta + 0.05 * sigma * rng.normal(size=len(sigma))
        sources = mode.sources + 0.05 * rng.normal(size=mode.sources.shape)
        assert objective(theta, sources) > lowest


def test_trace_begins_without_a_step_and_ends_below_the_tolerance(solution):
    trace = solution.mode.trace
    assert [row.iteration for row in trace] == list(range(len(trace)))
    assert np.isnan(trace[0].largest_step)
    assert trace[-1].largest_step < FitSettings().tolerance <= trace[-2].largest_step
    assert solution.mode.status is FitStatus.CONVERGED


def test_objective_falls_and_time_rises_along_the_trace(solution):
    for before, after in pairwise(solution.mode.trace):
        assert after.objective <= before.objective * (1.0 + 1e-9)
        assert after.seconds >= before.seconds


def test_trace_names_the_parameter_that_moved_most(solution, problem):
    ids = {f"source {i}" for i in problem.sources["source_id"]}
    labels = ("pointing", "position angle", "focal", "distortion", "detector", "pixel pitch")
    for row in solution.mode.trace[1:]:
        assert row.largest_parameter in ids or row.largest_parameter.startswith(labels)


@pytest.mark.parametrize("sign", [-1.0, 1.0], ids=["short", "long"])
def test_far_start_converges(sign):
    """The start is 200 arcsec off in pointing and 1 % in focal length."""
    orbit = make_orbit(pointing_error=200.0, focal_error=sign * 0.01)
    mode = find_mode(problem_of(orbit, FitSettings()), FitSettings())
    assert mode.status is FitStatus.CONVERGED
    assert mode.trace[-1].chi2 < 2.0 * len(orbit.pixels)


def test_start_ten_prior_widths_away_leads_to_the_same_mode(solution):
    problem, rng = solution.problem, np.random.default_rng(5)
    width = problem.priors.width
    theta = rng.uniform(-10.0, 10.0, len(width)) * np.where(
        np.isfinite(width), width, 180.0 * 360.0
    )
    covariance = np.linalg.inv(problem.priors.precision)
    spread = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    sources = rng.uniform(-10.0, 10.0, spread.shape) * spread
    start = solution.mode._replace(theta=theta, sources=sources)
    mode = find_mode(problem, FitSettings(), start=start)
    assert mode.status is FitStatus.CONVERGED
    turn = 1_296_000.0
    moved = mode.theta - solution.mode.theta
    columns = problem.layout.columns(BY_NAME["position_angle"])
    moved[columns] = np.remainder(moved[columns] + 0.5 * turn, turn) - 0.5 * turn
    sigma = np.sqrt(np.diag(solution.covariance.theta))
    assert np.abs(moved / sigma).max() < 1e-3
    sigma = np.sqrt(np.diagonal(solution.marginal, axis1=1, axis2=2))
    assert np.abs((mode.sources - solution.mode.sources) / sigma).max() < 1e-3


def test_overshooting_step_is_damped_and_the_fit_converges(monkeypatch):
    """An error of 75 deg in roll makes the full step too long, unless the attitude is solved."""
    monkeypatch.setattr(
        "solver.engines.gauss_newton.attitude_start", lambda problem, theta, *_: theta
    )
    orbit = make_orbit()
    exposures = orbit.data.exposures.assign(pa_est=orbit.data.exposures["pa_est"] + 75.0)
    data = replace(orbit.data, exposures=exposures)
    mode = find_mode(build_problem(data, MINI_MOCK, FitSettings()), FitSettings())
    objectives = [row.objective for row in mode.trace]
    assert any(row.damping > 0.0 for row in mode.trace)
    assert all(b <= a * (1 + 1e-9) for a, b in pairwise(objectives))
    assert mode.status is FitStatus.CONVERGED
    assert mode.trace[-1].chi2 < 2.0 * len(orbit.pixels)


@pytest.mark.parametrize("limit", [1, 2])
def test_number_of_iterations_is_limited(small_orbit, limit):
    settings = FitSettings(max_iterations=limit)
    mode = find_mode(problem_of(small_orbit, settings), settings)
    assert mode.status is FitStatus.MAX_ITERATIONS
    assert len(mode.trace) == limit + 1
    assert mode.reduced is not None


@pytest.mark.parametrize("seed", [2, 6])
def test_exact_jacobians_confirm_the_mode(seed):
    """A last step with reused Jacobians left both orbits half a tolerance off."""
    settings = FitSettings()
    problem = problem_of(make_orbit(seed=seed), settings)
    mode = find_mode(problem, settings)
    again = find_mode(problem, settings, start=mode)
    assert again.trace[1].largest_step < 0.1 * settings.tolerance


def test_tolerance_determines_when_to_stop(small_orbit, solution):
    settings = FitSettings(tolerance=50.0)
    loose = find_mode(problem_of(small_orbit, settings), settings)
    assert loose.status is FitStatus.CONVERGED
    assert len(loose.trace) < len(solution.mode.trace)


def test_progress_receives_every_row_of_the_trace(problem):
    rows = []
    mode = find_mode(problem, FitSettings(), rows.append)
    assert rows == mode.trace


@pytest.mark.parametrize("error", [CancelledError, KeyboardInterrupt], ids=lambda e: e.__name__)
def test_exception_of_progress_stops_the_fit(problem, error):
    calls = []

    def stop(iteration):
        calls.append(iteration)
        if len(calls) == 2:
            raise error

    with pytest.raises(error):
        find_mode(problem, FitSettings(), stop)
    assert len(calls) == 2


def test_nan_measurement_is_reported_as_not_finite(small_orbit):
    measurements = small_orbit.data.measurements.assign(nx=np.nan)
    data = replace(small_orbit.data, measurements=measurements)
    mode = find_mode(build_problem(data, MINI_MOCK, FitSettings()), FitSettings())
    assert mode.status is FitStatus.NOT_FINITE
    assert mode.reduced is None


@pytest.mark.parametrize(
    "names",
    [
        ("detector_x", "detector_y", "detector_rotation", "pitch_x", "pitch_y"),
        ("focal_length", "pitch_x", "pitch_y", "detector_x", "detector_y"),
    ],
    ids=["detectors", "scale"],
)
def test_unconstrained_direction_is_reported_as_singular(small_orbit, names):
    """The direction is common to exposures and detectors; rounding may seem to constrain it."""
    settings = FitSettings(prior_widths=dict.fromkeys(names, np.inf))
    mode = find_mode(problem_of(small_orbit, settings), settings)
    assert mode.status is FitStatus.SINGULAR
    assert mode.reduced is None
