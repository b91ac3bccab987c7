import numpy as np
import pytest
from scipy import stats

from solver.data.settings import FitSettings
from solver.linear.covariances import covariances
from solver.linear.leverage import residuals
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import eliminate_sources
from solver.problem.problem import build_problem
from solver.results.diagnostics import effective_parameters


@pytest.fixture
def at_point(problem, reduced, expansion_point):
    return residuals(problem, *expansion_point, covariances(reduced))


@pytest.fixture(scope="package")
def hat(dense):
    """The 2 x 2 leverage of every measurement, from the dense posterior."""
    jacobian = dense.jacobian.reshape(-1, 2, dense.jacobian.shape[1])
    return jacobian @ dense.covariance @ np.swapaxes(jacobian, 1, 2)


def test_covariances_equal_the_dense_ones(reduced, dense, problem):
    found, n = covariances(reduced), dense.n_calib
    sigma = np.sqrt(np.diag(dense.covariance))
    theta = dense.covariance[:n, :n] / np.outer(sigma[:n], sigma[:n])
    np.testing.assert_allclose(found.theta / np.outer(sigma[:n], sigma[:n]), theta, atol=1e-8)
    scale = sigma[:n, None, None]
    cross = dense.covariance[:n, n:].reshape(n, problem.n_src, 2).swapaxes(1, 2) / scale
    position, blocks = found.source_blocks.position, found.source_blocks.blocks
    is_own = np.zeros((n, problem.n_src), dtype=bool)
    for block in blocks:
        is_own[block.columns, block.places] = True
    expected = np.where(is_own[:, None, position], cross, 0.0)
    assert len(blocks) > 1
    in_order = found.own_cross[:, :, position]
    np.testing.assert_allclose(in_order / scale, expected, atol=1e-8 * sigma[n:].max())


def test_leverage_equals_the_dense_one(at_point, hat):
    np.testing.assert_allclose(at_point.trace, np.trace(hat, axis1=1, axis2=2), atol=1e-8)


def test_leverage_lies_between_zero_and_two(at_point):
    assert (at_point.trace > 0.0).all()
    assert (at_point.trace < 2.0).all()


def test_leverages_sum_to_the_effective_parameters(at_point, problem, reduced, expansion_point):
    prior_hessian = problem.priors.hessian_diagonal(expansion_point[0])
    expected = effective_parameters(problem.priors, prior_hessian, covariances(reduced))
    assert at_point.trace.sum() == pytest.approx(expected, rel=1e-8)


def test_whitened_residuals_equal_the_dense_ones(at_point, dense):
    np.testing.assert_allclose(at_point.whitened.ravel(), dense.residual, atol=1e-6)


def test_standardised_residuals_are_corrected_for_the_dense_leverage(at_point, dense, hat):
    whitened = dense.residual.reshape(-1, 2)
    values, vectors = np.linalg.eigh(np.eye(2) - hat)
    root = vectors @ (values[:, :, None] ** -0.5 * np.swapaxes(vectors, 1, 2))
    expected = (root @ whitened[:, :, None])[:, :, 0]
    usable = values.min(axis=1) > 1e-4
    assert usable.mean() > 0.9
    np.testing.assert_allclose(at_point.standardised[usable], expected[usable], atol=1e-5)


def test_standardised_residuals_have_unit_scatter(mocks):
    values = np.concatenate([s.residuals.standardised.ravel() for _, s in mocks])
    # Correlations within an orbit only increase the error of the standard deviation.
    limit = 4.0 / np.sqrt(2.0 * len(values) / 2.0)
    assert np.std(values) == pytest.approx(1.0, abs=limit)


def test_whitened_residuals_scatter_by_less_than_one(mocks):
    values = np.concatenate([s.residuals.whitened.ravel() for _, s in mocks])
    expected = np.mean([(2.0 - s.residuals.trace).mean() for _, s in mocks]) / 2.0
    assert np.mean(values**2) == pytest.approx(expected, rel=4.0 * np.sqrt(2.0 / len(values)))
    assert np.std(values) < 0.95


def test_sum_of_chi2_over_mocks_matches_its_expectation(mocks):
    """Degrees of freedom are 2 n_obs minus the leverage."""
    chi2 = sum((s.residuals.whitened**2).sum() for _, s in mocks)
    dof = sum((2.0 - s.residuals.trace).sum() for _, s in mocks)
    assert stats.chi2(dof).cdf(chi2) == pytest.approx(0.5, abs=0.499)


def test_measurement_that_determines_its_own_prediction_has_no_standardised_residual(small_orbit):
    """A source measured once, with a very wide prior: its residual is only rounding noise."""
    settings = FitSettings(prior_widths={"sources": 1e5})
    problem = build_problem(small_orbit.data, small_orbit.instrument, settings)
    rows = np.bincount(problem.measurements.index.source, minlength=problem.n_src)
    free = ~problem.sources["is_reference"].to_numpy(bool)
    alone = np.flatnonzero((rows == 1) & free)
    assert len(alone) > 0
    theta, sources = np.zeros(problem.layout.size), np.zeros((problem.n_src, 2))
    reduced = at_origin(problem, theta, sources)
    found = residuals(problem, theta, sources, covariances(reduced))
    is_alone = np.isin(problem.measurements.index.source, alone)
    assert np.isnan(found.standardised[is_alone]).all()
    assert np.isfinite(found.standardised[~is_alone]).all()
    np.testing.assert_allclose(found.trace[is_alone], 2.0, atol=1e-5)


def test_leverage_above_one_gives_no_standardised_residual(problem, reduced, expansion_point, hat):
    """With both eigenvalues of H above one, the determinant of I - H is positive."""
    found = covariances(reduced)
    fields = ("source", "theta", "own_cross")
    tripled = found._replace(**{name: 3.0 * getattr(found, name) for name in fields})
    found = residuals(problem, *expansion_point, tripled)
    above = np.linalg.eigvalsh(3.0 * hat).min(axis=1) > 1.0
    assert above.any()
    assert np.isnan(found.standardised[above]).all()


def at_origin(problem, theta, sources):
    return eliminate_sources(accumulate(problem, theta, sources), problem.priors)
