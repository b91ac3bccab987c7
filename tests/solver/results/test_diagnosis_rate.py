"""Probabilities by chance far in the tail, and the rate of false discoveries."""

import numpy as np
import pytest
from scipy import stats

from solver.results.diagnosis.rate import (
    discoveries,
    log_chance,
    log_chance_binomial,
    of_many,
    sigmas,
)


@pytest.mark.parametrize(("chi2", "dof"), [(3.0, 2.0), (40.0, 6.0), (600.0, 30.0)])
def test_chance_of_a_chi2_is_that_of_scipy(chi2, dof):
    assert log_chance(chi2, dof) == pytest.approx(stats.chi2.logsf(chi2, dof), rel=1e-9)


@pytest.mark.parametrize("dof", [2.0, 6.0, 30.0, 96.0])
def test_chance_of_a_chi2_goes_on_beyond_the_smallest_number(dof):
    chi2 = np.linspace(1200.0, 1700.0, 60)
    chance = np.array([log_chance(one, dof) for one in chi2])
    assert np.all(np.diff(chance) < 0.0)
    # No jump where the series takes over.
    assert np.abs(np.diff(chance, 2)).max() < 0.05


def test_sigmas_are_those_of_a_normal_value():
    assert sigmas(np.log(2.0 * stats.norm.sf(3.5))) == pytest.approx(3.5)
    assert sigmas(-5000.0) == pytest.approx(np.sqrt(2.0 * 5000.0), rel=0.01)
    assert sigmas(0.0) == 0.0


def test_most_extreme_of_many_is_less_rare():
    assert np.exp(of_many(np.log(0.01), 5)) == pytest.approx(1.0 - 0.99**5)
    assert of_many(-100.0, 10) == pytest.approx(-100.0 + np.log(10.0))


def test_all_of_many_orbits_are_no_chance():
    assert log_chance_binomial(2, 10, 0.1) == pytest.approx(np.log(1.0 - 0.9**10 - 0.9**9))
    assert log_chance_binomial(200, 200, 0.02) == pytest.approx(200.0 * np.log(0.02))
    # The most certain of all is a discovery.
    assert discoveries(np.array([-np.inf, np.log(0.9)]), 0.02).tolist() == [True, False]


def test_discoveries_follow_benjamini_and_hochberg():
    # The third is above its own limit, 0.03, but below that of the fourth.
    chances = np.log([0.9, 0.001, 0.031, 0.036, 0.011])
    assert discoveries(chances, 0.05).tolist() == [False, True, True, True, True]
    assert not discoveries(np.log([0.9, 0.02]), 0.03).any()
    assert discoveries(np.array([np.nan, np.log(0.01)]), 0.03).tolist() == [False, True]


def test_false_alarms_are_as_rare_as_stated():
    random = np.random.default_rng(3)
    alarms = [discoveries(np.log(random.uniform(size=40)), 0.1).any() for _ in range(2000)]
    assert np.mean(alarms) == pytest.approx(0.1, abs=0.02)
