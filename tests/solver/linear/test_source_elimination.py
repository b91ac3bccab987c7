from dataclasses import replace

import numpy as np
import pytest

from solver.data.settings import FitSettings
from solver.linear.covariances import cross_covariance, marginal_covariance
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import POORLY_CONSTRAINED, eliminate_sources
from solver.problem.problem import build_problem

# Required agreement of the elimination with the dense solution, relative to the uncertainties.
AGREEMENT = 1e-8


@pytest.fixture(scope="package")
def sigma(dense):
    return np.sqrt(np.diag(dense.covariance))


def blocks_of(covariance, n_calib):
    """Return the covariances of the calibration, between it and the sources, and of each source."""
    n_src = (len(covariance) - n_calib) // 2
    of_sources = covariance[n_calib:, n_calib:].reshape(n_src, 2, n_src, 2)
    return (
        covariance[:n_calib, :n_calib],
        covariance[:n_calib, n_calib:].reshape(n_calib, n_src, 2).swapaxes(1, 2),
        of_sources[np.arange(n_src), :, np.arange(n_src), :],
    )


def flat(theta, sources):
    return np.concatenate([theta, sources.ravel()])


def test_step_equals_the_dense_newton_step(reduced, dense, sigma):
    n = dense.n_calib
    step = reduced.solve(dense.gradient[:n], dense.gradient[n:].reshape(-1, 2))
    expected = dense.covariance @ dense.gradient
    np.testing.assert_allclose(
        flat(*step) / sigma, expected / sigma, atol=AGREEMENT * abs(expected / sigma).max()
    )


def test_calibration_covariance_equals_the_dense_one(reduced, dense, sigma):
    expected = blocks_of(dense.covariance, dense.n_calib)[0]
    scale = np.outer(sigma[: dense.n_calib], sigma[: dense.n_calib])
    found = reduced.theta_covariance()
    np.testing.assert_allclose(found / scale, expected / scale, atol=AGREEMENT)


def test_marginal_covariance_equals_the_dense_one(reduced, dense):
    expected = blocks_of(dense.covariance, dense.n_calib)[2]
    np.testing.assert_allclose(marginal_covariance(reduced), expected, rtol=AGREEMENT)


def test_conditional_covariance_equals_the_inverse_of_the_source_block(reduced, dense):
    expected = np.linalg.inv(blocks_of(dense.hessian, dense.n_calib)[2])
    np.testing.assert_allclose(reduced.conditional_covariance(), expected, rtol=AGREEMENT)


def test_conditional_covariance_is_below_the_marginal_one(reduced):
    difference = marginal_covariance(reduced) - reduced.conditional_covariance()
    assert np.linalg.eigvalsh(difference).min() > 0.0


def test_cross_covariance_equals_the_dense_one(reduced, dense, sigma):
    expected = blocks_of(dense.covariance, dense.n_calib)[1]
    source_sigma = sigma[dense.n_calib :].reshape(-1, 2).T
    scale = sigma[: dense.n_calib, None, None] * source_sigma
    found = cross_covariance(reduced)[:, :, reduced.source_blocks.position]
    np.testing.assert_allclose(found / scale, expected / scale, atol=AGREEMENT)


def test_response_is_minus_the_shift_of_sources_per_unit_of_the_calibration(reduced, dense):
    n = dense.n_calib
    expected = np.linalg.solve(dense.hessian[n:, n:], dense.hessian[n:, :n]).T
    found = reduced.response()[:, :, reduced.source_blocks.position]
    found = found.swapaxes(1, 2).reshape(expected.shape)
    np.testing.assert_allclose(found, expected, atol=AGREEMENT * np.abs(expected).max())


def test_log_determinant_equals_the_dense_one(reduced, dense):
    scale = np.sqrt(np.diag(dense.hessian))
    scaled = np.linalg.slogdet(dense.hessian / np.outer(scale, scale))[1]
    expected = scaled + 2.0 * np.log(scale).sum()
    assert reduced.log_determinant() == pytest.approx(expected, abs=1e-7)


def test_solve_accepts_any_right_hand_side(reduced, dense, sigma):
    rng = np.random.default_rng(0)
    right = rng.normal(size=len(sigma)) / sigma
    expected = dense.covariance @ right
    n = dense.n_calib
    found = flat(*reduced.solve(right[:n], right[n:].reshape(-1, 2)))
    np.testing.assert_allclose(found / sigma, expected / sigma, atol=1e-7)


def test_blocks_of_the_data_are_not_changed(equations, problem, expansion_point):
    """The blocks are reused when the priors change."""
    before = {k: np.copy(getattr(equations, k)) for k in ("theta", "source", "cross")}
    eliminate_sources(equations, problem.priors)
    for name, values in before.items():
        np.testing.assert_array_equal(getattr(equations, name), values)


def test_unconstrained_parameter_has_no_solution(equations, problem, expansion_point):
    """A parameter with neither data nor prior."""
    theta = equations.theta.copy()
    theta[0], theta[:, 0] = 0.0, 0.0
    cross = equations.cross.copy()
    cross[0] = 0.0
    width = problem.priors.width.copy()
    width[0] = np.inf
    priors = problem.priors._replace(width=width)
    unconstrained = replace(equations, theta=theta, cross=cross)
    assert eliminate_sources(unconstrained, priors) is None


def test_combination_that_only_priors_constrain_has_no_solution_with_flat_priors(
    equations, problem, expansion_point
):
    """A common shift of the detectors equals one of the pointings: flat priors leave it free."""
    flat_prior = problem.priors._replace(
        width=np.full(problem.layout.size, np.inf),
        is_gamma=np.zeros(problem.layout.size, dtype=bool),
    )
    assert eliminate_sources(equations, flat_prior) is None


def test_non_finite_values_have_no_solution(equations, problem, expansion_point):
    theta = equations.theta.copy()
    theta[2, 2] = np.nan
    assert eliminate_sources(replace(equations, theta=theta), problem.priors) is None


def test_weak_directions_are_common_changes_of_pointings_and_detectors(small_orbit, problem):
    """There are two shifts, a rotation and a scale, with the paper's priors."""
    wide = build_problem(small_orbit.data, small_orbit.instrument, FitSettings())
    origin = np.zeros(wide.layout.size), np.zeros((wide.n_src, 2))
    reduced = eliminate_sources(accumulate(wide, *origin), wide.priors)
    weak = reduced.weak_directions()
    assert weak.shape[1] == 4
    # One conditional sigma along them hardly raises chi2, unlike along any single parameter.
    cost = np.sum((reduced.factor @ weak) ** 2, axis=0)
    assert cost.max() < 1e-6


def test_poorly_constrained_directions_include_the_weak_ones(small_orbit):
    wide = build_problem(small_orbit.data, small_orbit.instrument, FitSettings())
    origin = np.zeros(wide.layout.size), np.zeros((wide.n_src, 2))
    reduced = eliminate_sources(accumulate(wide, *origin), wide.priors)
    weak, poorly_constrained = (
        reduced.weak_directions(),
        reduced.weak_directions(POORLY_CONSTRAINED),
    )
    assert poorly_constrained.shape[1] > weak.shape[1]
    cost = np.sum((reduced.factor @ poorly_constrained) ** 2, axis=0)
    assert cost.max() < POORLY_CONSTRAINED
    # Both sets are orthonormal in units of the parameters' conditional sigmas.
    overlap = (poorly_constrained.T * np.diag(reduced.theta)) @ weak
    np.testing.assert_allclose(overlap.T @ overlap, np.eye(weak.shape[1]), atol=1e-6)


def test_solve_does_not_move_along_fixed_directions(small_orbit):
    wide = build_problem(small_orbit.data, small_orbit.instrument, FitSettings())
    origin = np.zeros(wide.layout.size), np.zeros((wide.n_src, 2))
    reduced = eliminate_sources(accumulate(wide, *origin), wide.priors)
    weak = reduced.weak_directions()
    right = np.random.default_rng(1).normal(size=wide.layout.size)
    step, _ = reduced.solve(right, np.zeros((wide.n_src, 2)), weak)
    scale = np.sqrt(np.diag(reduced.theta))
    share = (weak * scale[:, None]).T @ (scale * step)
    assert np.abs(share).max() < 1e-9 * np.linalg.norm(scale * step)
