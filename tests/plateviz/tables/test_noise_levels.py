"""Mean residuals, shifts of detectors and correlations of orbits that are really fitted."""

import numpy as np
import pytest

from plateviz import tables
from solver.data.settings import FitSettings
from solver.fit import fit_orbit
from solver.io.survey import read_survey_orbit

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def orbit(made_survey):
    return read_survey_orbit(made_survey, 1)


@pytest.fixture(scope="module")
def fitted(orbit):
    return fit_orbit(orbit)


@pytest.fixture(scope="module")
def low_order(orbit):
    return fit_orbit(orbit, settings=FitSettings(order=2))


def test_mean_residuals_of_a_good_fit_are_noise(fitted, instrument):
    found = tables.map_statistics(tables.mean_residuals(fitted, instrument))
    assert found.spread == pytest.approx(1.0, abs=0.15)
    assert found.largest < found.limit


def test_mean_residuals_show_an_order_that_is_too_low(low_order, instrument):
    found = tables.map_statistics(tables.mean_residuals(low_order, instrument))
    assert found.spread > 5.0
    assert found.largest > 3.0 * found.limit


@pytest.mark.parametrize("together", [1, 6])
def test_shifts_of_a_good_fit_are_noise(fitted, instrument, together):
    table = tables.detector_shifts(fitted, instrument, together=[together])
    pulls = table[["pull_x", "pull_y"]].to_numpy()
    assert np.sqrt(np.mean(pulls**2)) == pytest.approx(1.0, abs=0.15)
    found = tables.shift_statistics(table)
    assert found.largest < found.limit


def test_correlation_of_a_good_fit_is_noise(fitted, instrument):
    table = tables.residual_correlation(fitted, instrument)
    found = tables.correlation_statistics(table)
    assert max(found.largest_e, found.largest_b) < found.limit
    for name in ("pull_e", "pull_b"):
        # Bins are correlated through the integral.
        assert np.sqrt(np.mean(table[name] ** 2)) == pytest.approx(1.0, abs=0.6)


def test_correlation_shows_that_the_distortion_left_over_is_a_gradient(low_order, instrument):
    found = tables.correlation_statistics(tables.residual_correlation(low_order, instrument))
    assert found.largest_e > 10.0 * found.limit
    assert found.largest_e > 3.0 * found.largest_b
