import numpy as np
import pandas as pd
import pytest
import scipy.linalg as sl
from scipy import stats

from solver.data.settings import FitSettings
from solver.linear.chi2 import gradient
from solver.linear.covariances import covariances
from solver.results.diagnostics import (
    deviation_freedom,
    effective_parameters,
    error_budget,
    induced_shift,
    log_evidence,
    mean_covariance,
    normalised_deviation,
)
from tests.solver.conftest import solve
from tests.solver.small_orbit import make_orbit, true_offsets


def members_of(problem):
    return ~problem.sources["is_reference"].to_numpy(bool)


def test_effective_parameters_equal_the_dense_ones(problem, reduced, dense, expansion_point):
    expected = len(dense.hessian) - np.trace(dense.prior @ dense.covariance)
    prior_hessian = problem.priors.hessian_diagonal(expansion_point[0])
    found = effective_parameters(problem.priors, prior_hessian, covariances(reduced))
    assert found == pytest.approx(expected, rel=1e-8)


def test_mean_covariance_equals_the_dense_one(problem, reduced, dense):
    members = np.flatnonzero(members_of(problem))
    average = np.zeros((2, len(dense.hessian)))
    for axis in range(2):
        average[axis, dense.n_calib + 2 * members + axis] = 1.0 / len(members)
    expected = average @ dense.covariance @ average.T
    found = mean_covariance(reduced, members_of(problem))
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-8 * expected.max())


def test_induced_shift_equals_the_dense_one(problem, reduced, dense):
    rng, n = np.random.default_rng(0), dense.n_calib
    error = rng.normal(size=(problem.n_src, 2)) * ~members_of(problem)[:, None]
    pull = dense.prior[n:, n:] @ error.ravel()
    expected = (dense.covariance[n:, n:] @ pull).reshape(-1, 2)
    found = induced_shift(reduced, problem.priors, error)
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("cause", ["noise", "catalogue", "calibration"])
def test_error_budget_equals_the_dense_one(problem, reduced, dense, cause):
    """The reference is H^-1 M H^-1, with M the data's Hessian or the precision of the priors."""
    n, calibration_prior = dense.n_calib, np.zeros_like(dense.prior)
    calibration_prior[:n, :n] = dense.prior[:n, :n]
    middle = {
        "noise": dense.jacobian.T @ dense.jacobian,
        "catalogue": dense.prior - calibration_prior,
        "calibration": calibration_prior,
    }[cause]
    full = (dense.covariance @ middle @ dense.covariance)[n:, n:]
    full = full.reshape(problem.n_src, 2, problem.n_src, 2)
    expected = full[np.arange(problem.n_src), :, np.arange(problem.n_src), :]
    covariance = covariances(reduced)
    found = getattr(error_budget(reduced, problem.priors, covariance), cause)
    # In units of the uncertainties, like other tests of the elimination.
    scale = np.sqrt(np.diagonal(covariance.source, axis1=1, axis2=2))
    scale = scale[:, :, None] * scale[:, None, :]
    np.testing.assert_allclose(found / scale, expected / scale, atol=1e-8)


def test_reference_sources_scatter_by_less_than_their_uncertainty(problem, reduced):
    """Their errors due to the catalogue are the same in every orbit."""
    covariance = covariances(reduced)
    noise = error_budget(reduced, problem.priors, covariance).noise
    share = np.trace(noise, axis1=1, axis2=2) / np.trace(covariance.source, axis1=1, axis2=2)
    references = ~members_of(problem)
    assert share[references].max() < 0.5
    assert share.min() > 0.0
    assert np.median(share[~references]) > 0.8


def test_shifting_the_reference_catalogue_moves_the_solution_by_the_induced_shift(
    small_orbit, solution, with_tables
):
    """The reference is a refit with the reference sources 0.4 mas further east."""
    catalogue = small_orbit.data.catalogue
    shift = 0.4 * catalogue["is_reference"] / 3.6e6 / np.cos(np.radians(catalogue["dec"]))
    moved_catalogue = catalogue.assign(ra=catalogue["ra"] + shift)
    moved = solve(with_tables(small_orbit, catalogue=moved_catalogue))
    error = np.zeros((solution.problem.n_src, 2))
    error[~members_of(solution.problem), 0] = 0.4
    expected = induced_shift(solution.reduced, solution.problem.priors, error)
    # Offsets are relative to the prior positions, which have moved too.
    found = moved.mode.sources + error - solution.mode.sources
    np.testing.assert_allclose(found, expected, atol=2e-3)
    assert np.abs(expected).max() > 0.3


def test_deviation_freedom_equals_the_dense_one(problem, reduced, dense):
    references = np.flatnonzero(~members_of(problem))
    variances = np.diagonal(np.linalg.inv(problem.priors.precision), axis1=1, axis2=2)
    expected = []
    for axis in range(2):
        rows = dense.n_calib + 2 * references + axis
        sigma = np.sqrt(variances[references, axis])
        covariance = dense.covariance[np.ix_(rows, rows)] / np.outer(sigma, sigma)
        deviations = np.eye(len(rows)) - covariance
        expected.append(np.trace(deviations) ** 2 / np.trace(deviations @ deviations))
    found = deviation_freedom(reduced, covariances(reduced), variances, ~members_of(problem))
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert (found < len(references)).all()


def test_normalised_deviation_scatters_over_mocks_as_its_freedom_says(mocks):
    ratios, freedoms = [], []
    for _, solution in mocks:
        is_reference = ~members_of(solution.problem)
        variances = np.diagonal(np.linalg.inv(solution.problem.priors.precision), axis1=1, axis2=2)
        marginal = np.diagonal(solution.covariance.source, axis1=1, axis2=2)
        found = normalised_deviation(solution.mode.sources, variances, marginal, is_reference)
        freedom = deviation_freedom(solution.reduced, solution.covariance, variances, is_reference)
        ratios.append((found.measured / found.expected) ** 2)
        freedoms.append(freedom)
    tails = stats.chi2.sf(np.array(ratios) * np.array(freedoms), np.array(freedoms))
    assert stats.kstest(tails.ravel(), "uniform").pvalue > 0.01


def test_normalised_deviation_equals_that_of_the_paper():
    """Eq. (result:deviation) uses only the reference sources."""
    sources = np.array([[0.3, -0.2], [0.1, 0.5], [900.0, 900.0]])
    prior, marginal = np.full((3, 2), 0.25), np.full((3, 2), 0.09)
    found = normalised_deviation(sources, prior, marginal, np.array([True, True, False]))
    expected = [np.sqrt((0.09 + 0.01) / 2 / 0.25), np.sqrt((0.04 + 0.25) / 2 / 0.25)]
    np.testing.assert_allclose(found.measured, expected)
    np.testing.assert_allclose(found.expected, np.sqrt(1.0 - 0.36))


def test_normalised_deviation_has_its_expected_value_over_mocks(mocks):
    measured, expected = [], []
    for _, solution in mocks:
        variances = np.diagonal(np.linalg.inv(solution.problem.priors.precision), axis1=1, axis2=2)
        marginal = np.diagonal(solution.covariance.source, axis1=1, axis2=2)
        found = normalised_deviation(
            solution.mode.sources, variances, marginal, ~members_of(solution.problem)
        )
        measured.append(found.measured**2)
        expected.append(found.expected**2)
    measured, expected = np.array(measured), np.array(expected)
    error = measured.std(axis=0, ddof=1) / np.sqrt(len(mocks))
    np.testing.assert_array_less(np.abs(measured.mean(axis=0) - expected.mean(axis=0)), 4 * error)
    assert (error < 0.15 * expected.mean(axis=0)).all()
    assert (expected < 0.5).all()


def test_evidence_equals_the_density_of_the_data_in_the_linearised_model(make_dense):
    """The reference is log N(data; mean, noise + J P J'), which needs proper priors."""
    settings = FitSettings(prior_widths={"position_angle": 300.0}, tolerance=1e-6)
    solution = solve(make_orbit(), settings)
    problem, mode = solution.problem, solution.mode
    dense = make_dense(problem, mode.theta, mode.sources)
    n = dense.n_calib
    point = np.concatenate([mode.theta, mode.sources.ravel()])
    precision = dense.prior.copy()
    precision[:n, :n] = np.diag(problem.priors.width**-2.0)
    # Data of the linear model, whose prediction at the mode is the exact one.
    mean = dense.residual + dense.jacobian @ point
    covariance = np.eye(len(mean)) + dense.jacobian @ np.linalg.inv(precision) @ dense.jacobian.T
    # Nearly flat priors give it a condition number of 4e13: the rounding error of a general solver
    # would be as large as the tolerance, that of the triangular one is a fifth of it.
    factor = np.linalg.cholesky(covariance)
    whitened = sl.solve_triangular(factor, mean, lower=True)
    log_det = 2.0 * np.log(np.diag(factor)).sum()
    log_sigma = float(np.log(problem.measurements.sigma).sum())
    expected = -0.5 * (len(mean) * np.log(2 * np.pi) + log_det)
    expected -= 0.5 * whitened @ whitened + log_sigma
    found = log_evidence(mode, problem.priors, mode.trace[-1].objective, log_sigma, len(mean))
    # The skewness of the gamma priors contributes some hundredths.
    assert found == pytest.approx(expected, abs=0.1)


def penalised_chi2(problem, theta, sources):
    return gradient(problem, theta, sources).chi2 + problem.priors.penalty(theta, sources)


def test_penalised_chi2_at_the_mode_matches_the_number_of_coordinates_over_mocks(mocks):
    """Expected is one per coordinate, minus pointings and rolls, whose priors are nearly flat."""
    total = sum(solution.mode.trace[-1].objective for _, solution in mocks)
    count = sum(2 * solution.problem.n_obs - 3 * 8 for _, solution in mocks)
    assert 0.001 < stats.chi2(count).cdf(total) < 0.999


def test_truth_lies_above_the_mode_by_the_number_of_parameters_over_mocks(mocks):
    """This uses all parameters and the exact likelihood."""
    total, count = 0.0, 0
    for orbit, solution in mocks:
        problem = solution.problem
        at_truth = penalised_chi2(problem, *true_offsets(orbit, problem))
        total += at_truth - solution.mode.trace[-1].objective
        count += problem.layout.size + 2 * problem.n_src
    assert 0.001 < stats.chi2(count).cdf(total) < 0.999


@pytest.mark.parametrize("kind", ["reference", "others"])
def test_pulls_of_the_sources_have_unit_scatter_over_mocks(mocks, kind):
    pulls = []
    for orbit, solution in mocks:
        _, sources = true_offsets(orbit, solution.problem)
        sigma = np.sqrt(np.diagonal(solution.covariance.source, axis1=1, axis2=2))
        members = members_of(solution.problem) == (kind == "others")
        pulls.append(((solution.mode.sources - sources) / sigma)[members])
    # Sources share the calibration, so the number of orbits limits the accuracy.
    squares = np.array([np.mean(p**2) for p in pulls])
    error = squares.std(ddof=1) / np.sqrt(len(squares))
    assert squares.mean() == pytest.approx(1.0, abs=4.0 * error)
    assert error < 0.12


def test_mean_error_of_the_sources_matches_its_covariance(mocks):
    """Its square in the metric of `mean_covariance` follows a chi2 distribution over the mocks."""
    total = 0.0
    for orbit, solution in mocks:
        _, sources = true_offsets(orbit, solution.problem)
        members = members_of(solution.problem)
        mean = (solution.mode.sources - sources)[members].mean(axis=0)
        total += mean @ np.linalg.solve(mean_covariance(solution.reduced, members), mean)
    assert 0.001 < stats.chi2(2 * len(mocks)).cdf(total) < 0.999


def test_mean_error_of_no_source_is_unknown(mocks):
    _, solution = mocks[0]
    nobody = np.zeros(solution.problem.n_src, dtype=bool)
    assert np.isnan(mean_covariance(solution.reduced, nobody)).all()


def test_pulls_with_conditional_sigmas_scatter_by_more(mocks):
    """Marginal sigmas are needed: conditional ones omit the errors of the calibration."""
    ratios = [
        np.sqrt(
            np.diagonal(s.covariance.source, axis1=1, axis2=2)
            / np.diagonal(s.reduced.conditional_covariance(), axis1=1, axis2=2)
        )
        for _, s in mocks
    ]
    assert pd.Series(np.concatenate(ratios).ravel()).median() > 1.1
