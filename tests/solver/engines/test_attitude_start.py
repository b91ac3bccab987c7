from dataclasses import replace

import numpy as np
import pytest

from solver.data.parameters import BY_NAME
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.engines.attitude_start import attitude_start
from solver.engines.gauss_newton import find_mode
from solver.linear.chi2 import gradient
from solver.problem.problem import build_problem, of_rows
from tests.solver.small_orbit import true_offsets

# Accuracy of the attitude: aberration and distortion are neglected, and the detectors and focal
# lengths are nominal.
POINTING_ARCSEC, ROLL_ARCSEC = 60.0, 600.0
ATTITUDE = ("pointing_ra", "pointing_dec", "position_angle")


def displaced(orbit, pointing_deg=0.0, roll_deg=0.0):
    """Return the problem of an orbit whose estimated attitudes are off by other angles each."""
    rng = np.random.default_rng(4)
    exposures = orbit.data.exposures
    ra, dec, angle = rng.uniform(-1.0, 1.0, (3, len(exposures)))
    moved = exposures.assign(
        ra_est=exposures["ra_est"] + pointing_deg * ra,
        dec_est=exposures["dec_est"] + pointing_deg * dec,
        pa_est=exposures["pa_est"] + roll_deg * angle,
    )
    data = replace(orbit.data, exposures=moved)
    return build_problem(data, orbit.instrument, FitSettings())


def started(problem):
    """Return the start of a problem, from its origins."""
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    return attitude_start(problem, theta, sources, gradient(problem, theta, sources).chi2)


@pytest.mark.parametrize(("pointing_deg", "roll_deg"), [(0.0, 180.0), (1.0, 0.0), (10.0, 180.0)])
def test_attitude_follows_from_the_measurements(small_orbit, pointing_deg, roll_deg):
    problem = displaced(small_orbit, pointing_deg, roll_deg)
    truth = problem.layout.scatter(true_offsets(small_orbit, problem)[0])
    found = problem.layout.scatter(started(problem))
    for name, limit in zip(ATTITUDE, (POINTING_ARCSEC,) * 2 + (ROLL_ARCSEC,), strict=True):
        error = found[name] - truth[name]
        if name == "position_angle":
            error = np.remainder(error + 648_000.0, 1_296_000.0) - 648_000.0
        assert np.abs(error).max() < limit


def test_only_attitudes_move(small_orbit):
    problem = displaced(small_orbit, 1.0, 180.0)
    moved = np.flatnonzero(started(problem))
    attitudes = [problem.layout.columns(BY_NAME[name]) for name in ATTITUDE]
    assert set(moved) == set(np.concatenate(attitudes))


def test_start_near_the_solution_is_kept(problem):
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    chi2 = gradient(problem, theta, sources).chi2
    assert attitude_start(problem, theta, sources, chi2) is theta
    assert attitude_start(problem, theta, sources, np.nan) is theta


def test_position_angle_about_a_single_source_is_kept(small_orbit):
    problem = displaced(small_orbit, 1.0)
    index = problem.measurements.index
    of_first = np.flatnonzero(index.exposure == 0)
    lonely = of_rows(problem, np.isin(np.arange(problem.n_obs), of_first[1:], invert=True))
    found = lonely.layout.scatter(started(lonely))
    assert np.hypot(found["pointing_ra"][0], found["pointing_dec"][0]) > 100.0
    assert abs(found["position_angle"][0]) < 3.6e3


def test_pointing_beyond_the_horizon_of_its_estimate_is_kept(small_orbit):
    exposures = small_orbit.data.exposures
    away = exposures.assign(ra_est=(exposures["ra_est"] + 180.0) % 360.0)
    data = replace(small_orbit.data, exposures=away)
    problem = build_problem(data, small_orbit.instrument, FitSettings())
    assert not started(problem).any()
    assert not find_mode(problem, FitSettings()).status.is_solution


@pytest.mark.parametrize(("pointing_deg", "roll_deg"), [(3.0, 180.0), (0.0, 180.0)])
def test_solution_does_not_depend_on_the_estimated_attitudes(small_orbit, pointing_deg, roll_deg):
    """The prior centres of the pointings move, which shifts the sources by next to nothing."""
    before, after = (
        find_mode(problem, FitSettings())
        for problem in (displaced(small_orbit), displaced(small_orbit, pointing_deg, roll_deg))
    )
    assert after.status is FitStatus.CONVERGED
    assert len(after.trace) < 9
    sigma = before.reduced.sigmas[1]
    # The centres of the priors of the pointings move the mode by up to a thousandth of a sigma.
    assert np.abs((after.sources - before.sources) / sigma).max() < 5e-3
