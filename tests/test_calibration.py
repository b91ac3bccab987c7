"""The campaign that checks uncertainties finds those that are wrong, and those of a fit right."""

import numpy as np
import pytest

from solver.data.parameters import CALIBRATION_GROUPS
from solver.data.settings import FitSettings
from solver.fit import fit_orbit
from solver.linear.chi2 import gradient
from solver.problem.problem import build_problem
from tests.campaigns.coverage import (
    GROUPS,
    OTHERS,
    failures,
    figures,
    pull_sums,
    rank_table,
    sums_of,
    table,
    uniformity,
)
from tests.campaigns.prior_draws import Size, centre_seen_at, draw_orbit, tangent_offset

SIZE = Size(references=20, others=60, exposures_per_field=2)
SEEDS = range(3)
KINDS = ("marginal", "conditional")


@pytest.fixture(scope="module")
def orbits():
    return [draw_orbit(seed, SIZE) for seed in SEEDS]


@pytest.fixture(scope="module")
def results(orbits):
    return [fit_orbit(orbit.data, orbit.instrument) for orbit in orbits]


@pytest.fixture(scope="module")
def records(orbits, results):
    return [sums_of(result, o.truth) for result, o in zip(results, orbits, strict=True)]


def simulated(rng, scale=1.0, shared=0.0):
    """Return a record of normal pulls, which may share a part of their variance."""
    common = np.sqrt(shared) * rng.normal()
    pulls = scale * (common + np.sqrt(1.0 - shared) * rng.normal(size=100))
    return dict.fromkeys(GROUPS, pull_sums(pulls, dict.fromkeys(KINDS, 1.0)))


def many(count=200, **kwargs):
    rng = np.random.default_rng(0)
    return [simulated(rng, **kwargs) for _ in range(count)]


def test_truth_explains_the_measurements_up_to_their_noise(orbits, results):
    """The offsets that the campaign calls true, put into the model of the fit."""
    for orbit, result in zip(orbits, results, strict=True):
        problem = build_problem(orbit.data, orbit.instrument, FitSettings())
        sources = 1e3 * tangent_offset(
            *(result.true_places[axis].to_numpy() for axis in ("ra", "dec")),
            *(result.sources[f"prior_{axis}"].to_numpy() for axis in ("ra", "dec")),
        )
        chi2 = gradient(problem, problem.layout.gather(orbit.truth), sources).chi2
        count = 2 * problem.n_obs
        assert chi2 == pytest.approx(count, abs=5.0 * np.sqrt(2.0 * count))


def test_every_calibration_group_is_drawn(orbits):
    names = {group.name for group in CALIBRATION_GROUPS}
    assert set(orbits[0].truth) == names
    for name in names:
        assert np.ptp(np.concatenate([orbit.truth[name] for orbit in orbits])) > 0.0


def test_marginal_sigmas_of_a_fit_are_right(records):
    rms, *_ = figures([record[OTHERS] for record in records], "marginal")
    assert rms.value == pytest.approx(1.0, abs=0.15)
    for group in GROUPS:
        assert figures([record[group] for record in records], "marginal")[0].value < 2.5


def test_conditional_sigmas_are_too_small_with_few_references(records):
    conditional, marginal = (
        figures([record[OTHERS] for record in records], kind)[0].value
        for kind in ("conditional", "marginal")
    )
    assert conditional > 1.05 * marginal


def test_right_sigmas_are_accepted():
    assert not failures(many(), 0.02, 0.01)
    assert uniformity([record[OTHERS] for record in many()]) > 0.01


@pytest.mark.parametrize("scale", [0.96, 1.04])
def test_wrong_sigmas_are_rejected(scale):
    off = failures(many(scale=scale), 0.02, 0.01)
    assert {line.partition(":")[0] for line in off} == set(GROUPS)
    assert uniformity([record[OTHERS] for record in many(scale=scale)]) < 1e-3


def test_standard_error_is_that_of_pulls_which_share_their_error():
    """Pulls that are all equal count once per orbit."""
    rms, *_ = figures([record[OTHERS] for record in many(400, shared=1.0)], "marginal")
    assert rms.error == pytest.approx(1.0 / np.sqrt(2.0 * 400), rel=0.2)


def test_few_orbits_are_not_judged(records):
    assert not failures(records, 0.0, 0.0)
    assert np.isnan(uniformity([record[OTHERS] for record in records]))


def test_table_has_a_row_for_every_group(records):
    rows = table(records)
    assert rows["group"].tolist() == list(GROUPS)
    assert rank_table(records)["group"].tolist() == list(GROUPS)


def test_centres_are_where_others_are_seen_at_the_given_offset():
    rng = np.random.default_rng(1)
    ra, dec = rng.uniform(0.0, 360.0, 20), rng.uniform(-60.0, 60.0, 20)
    offset = rng.normal(size=(20, 2)) * 36_000.0
    found = tangent_offset(ra, dec, *centre_seen_at(ra, dec, offset))
    np.testing.assert_allclose(found, offset, atol=1e-6)
