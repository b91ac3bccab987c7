import numpy as np
import pytest
from scipy import stats

from solver.data.survey_schema import N_DRAWS
from solver.model.apparent_motion import julian_year
from solver.results.motion import fit_motions
from tests.solver.survey_history import EPOCH, epochs_of, make_history

N_SOURCES, N_ORBITS = 300, 40


@pytest.fixture(scope="module")
def motions():
    scale = np.array([5.0, 5.0, 1.0, 2.0, 2.0])
    return scale * np.random.default_rng(1).standard_normal((N_SOURCES, 5))


def test_julian_year_of_the_standard_epoch_is_2000():
    assert julian_year(np.array([51_544.5]))[0] == 2000.0


def test_motion_without_noise_is_found_exactly(motions):
    history = make_history(motions, N_ORBITS, noise=1e-9)
    fit = fit_motions(history, EPOCH)
    np.testing.assert_allclose(fit.motion, motions, atol=1e-6)
    np.testing.assert_allclose(fit.true, motions, atol=1e-6)


def test_pulls_are_unit_normal(motions):
    fit = fit_motions(make_history(motions, N_ORBITS), EPOCH)
    pulls = (fit.motion - motions) / np.sqrt(np.diagonal(fit.noise, axis1=1, axis2=2))
    for values in pulls.T:
        assert stats.kstest(values, "norm").pvalue > 1e-3
    assert pulls.std() == pytest.approx(1.0, abs=4.0 / np.sqrt(2 * pulls.size))


def test_mean_chi2_equals_its_degrees_of_freedom(motions):
    fit = fit_motions(make_history(motions, N_ORBITS), EPOCH)
    dof = 2 * N_ORBITS - 5
    assert fit.chi2.mean() == pytest.approx(dof, abs=4.0 * np.sqrt(2.0 * dof / N_SOURCES))


def test_residuals_scatter_as_expected(motions):
    fit = fit_motions(make_history(motions, N_ORBITS), EPOCH)
    ratio = (fit.residual**2).sum() / fit.expected.sum()
    assert ratio == pytest.approx(1.0, abs=4.0 * np.sqrt(1.0 / fit.residual.size))


def test_catalogue_errors_are_inherited_in_full(motions):
    """An error that is the same in all orbits does not average out: the fit inherits it."""
    draws = np.random.default_rng(2).standard_normal((3, N_DRAWS, 5))
    fit = fit_motions(make_history(motions[:3], N_ORBITS, draws=draws), EPOCH)
    expected = np.einsum("sdp,sdq->spq", draws, draws) / N_DRAWS
    np.testing.assert_allclose(fit.catalogue, expected, atol=1e-5)


def test_orbits_are_weighted_by_their_noise(motions):
    history = make_history(motions, N_ORBITS)
    bad = history["orbit_id"] == 3
    history.loc[bad, ["sigma_ra_noise", "sigma_dec_noise"]] = 1e3
    history.loc[bad, ["offset_ra", "offset_dec"]] += 100.0
    fit = fit_motions(history, EPOCH)
    sigma = np.sqrt(np.diagonal(fit.noise, axis1=1, axis2=2))
    assert np.abs((fit.motion - motions) / sigma).max() < 6.0


def test_source_with_two_orbits_has_no_motion(motions):
    fit = fit_motions(make_history(motions[:2], 2), EPOCH)
    assert np.isnan(fit.motion).all()


def test_one_orbit_at_the_epoch_has_no_motion(motions):
    history = make_history(motions[:1], 1)
    epoch = float(julian_year(history["epoch"].to_numpy())[0])
    assert np.isnan(fit_motions(history, epoch).motion).all()


def test_sources_with_different_numbers_of_orbits_are_separate(motions):
    full = make_history(motions[:2], N_ORBITS, noise=1e-9)
    mixed = full[(full["source_id"] == full["source_id"].min()) | (full["orbit_id"] < 6)]
    fit = fit_motions(mixed.reset_index(drop=True), EPOCH)
    np.testing.assert_allclose(fit.motion, motions[:2], atol=1e-5)
    assert fit.first.tolist() == [0, N_ORBITS]


def test_epochs_span_three_years():
    assert np.ptp(epochs_of(N_ORBITS)) > 2.4 * 365.25
