"""The results derived in assets/docs/uncertainties.md, on a small orbit."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro.infer import Trace_ELBO

from solver.data.parameters import SOURCES
from solver.engines.numpyro_model import in_coordinates, model_input
from solver.engines.svi_guide import SITES, Means, guide
from solver.linear.covariances import covariances
from solver.linear.source_elimination import eliminate_sources
from solver.linear.whitening import in_bare_units, whitened
from solver.results.diagnostics import error_budget, log_evidence

# All combinations of signs for the two axes of a source: mean, variance and correlation are exact.
SIGNS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])


@pytest.fixture(scope="module")
def reduced_at_mode(solution):
    return replace(solution.reduced, at=(solution.mode.theta, solution.mode.sources))


@pytest.fixture(scope="module")
def loss(solution):
    """Return the function that computes minus the evidence lower bound of a guide by numpyro."""
    inputs = jax.device_put(model_input(solution.problem))
    shape = (2, solution.problem.n_src)

    @jax.jit
    def loss_for_signs(coordinates, means, signs):
        return Trace_ELBO().loss(
            jax.random.key(0),
            dict(zip(SITES, means, strict=True)),
            lambda: in_coordinates(inputs, coordinates),
            lambda: guide(means, jnp.broadcast_to(signs[:, None], shape)),
        )

    return lambda *at: np.mean([float(loss_for_signs(*at, signs)) for signs in SIGNS])


@pytest.fixture(scope="module")
def at_mode(solution):
    """Return the function that makes a guide at the mode with given widths."""
    n_calib, n_src = solution.problem.layout.size, solution.problem.n_src

    def make(scale):
        widths = np.broadcast_to(scale, (2, n_src)).copy()
        return Means(np.zeros(n_calib), np.zeros((2, n_src)), widths)

    return make


def independent_widths(reduced):
    """Return 1 / sqrt(diag V_i), in the published code's unit."""
    precision = np.einsum("sab,scb->sac", reduced.source_factor, reduced.source_factor)
    return 1.0 / np.sqrt(np.diagonal(precision, axis1=1, axis2=2)).T / SOURCES.per_value_unit


@pytest.mark.parametrize("site", range(len(SITES)), ids=SITES)
def test_best_guide_is_at_the_mode_with_the_inverse_of_each_source_block(
    reduced_at_mode, loss, at_mode, site
):
    """In whitened coordinates a width of one means C_i = V_i^-1."""
    coordinates, means = whitened(reduced_at_mode), at_mode(1.0)
    signs = np.random.default_rng(site).choice([-1.0, 1.0], means[site].shape)
    up, down = (
        loss(coordinates, means._replace(**{means._fields[site]: means[site] + step * signs}))
        for step in (1e-3, -1e-3)
    )
    # A guide one sigma away would have a slope of the length of this direction.
    assert abs(up - down) / 2e-3 < 0.01 * np.sqrt(signs.size)
    assert up + down > 2.0 * loss(coordinates, means)


def test_unit_width_is_the_conditional_covariance(reduced_at_mode, at_mode):
    found = whitened(reduced_at_mode).covariance(at_mode(1.0).scale)
    np.testing.assert_allclose(found, reduced_at_mode.conditional_covariance(), rtol=1e-9)


def test_best_independent_normals_have_the_inverse_of_the_diagonal(
    solution, reduced_at_mode, loss, at_mode
):
    """This is the paper's guide, in the coordinates of the published code."""
    coordinates = in_bare_units(solution.problem.layout, reduced_at_mode.at)
    widths = independent_widths(reduced_at_mode)
    up, down = (loss(coordinates, at_mode(widths * (1.0 + step))) for step in (1e-3, -1e-3))
    assert abs(up - down) / 2e-3 < 1e-3 * widths.size
    # The small orbit has different sigmas in x and y, which makes these widths narrower.
    full = np.diagonal(reduced_at_mode.conditional_covariance(), axis1=1, axis2=2).T
    shrunk = widths * SOURCES.per_value_unit / np.sqrt(full)
    assert shrunk.max() <= 1.0 + 1e-9
    assert shrunk.min() < 0.98


def test_evidence_exceeds_the_bound_by_the_density_of_the_calibration(
    solution, reduced_at_mode, loss, at_mode
):
    """The difference is K/2 log 2 pi in whitened coordinates, where the density is unit normal."""
    problem = solution.problem
    evidence = log_evidence(
        solution.mode,
        problem.priors,
        solution.mode.trace[-1].objective,
        float(np.log(problem.measurements.sigma).sum()),
        2 * problem.n_obs,
    )
    bound = -loss(whitened(reduced_at_mode), at_mode(1.0))
    deficit = 0.5 * problem.layout.size * np.log(2.0 * np.pi)
    assert evidence - bound == pytest.approx(deficit, abs=0.1)


def test_scatter_and_offset_sum_to_the_full_covariance(problem, reduced, dense):
    """H^-1 H_data H^-1 + H^-1 P H^-1 = H^-1, also for the block of every source."""
    sigma = np.sqrt(np.diag(dense.covariance))
    terms = (dense.jacobian.T @ dense.jacobian, dense.prior)
    total = sum(dense.covariance @ middle @ dense.covariance for middle in terms)
    scale = np.outer(sigma, sigma)
    np.testing.assert_allclose(total / scale, dense.covariance / scale, atol=1e-8)
    n = dense.n_calib
    full = total[n:, n:].reshape(problem.n_src, 2, problem.n_src, 2)
    expected = full[np.arange(problem.n_src), :, np.arange(problem.n_src), :]
    found = sum(error_budget(reduced, problem.priors, covariances(reduced)))
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_source_with_fixed_calibration_scatters_by_the_noise_of_its_data(problem, equations):
    """With the calibration fixed, the noise covariance is C_i V_i,data C_i."""
    fixed = problem.priors._replace(width=np.full_like(problem.priors.width, 1e-9))
    reduced = eliminate_sources(equations, fixed)
    found = error_budget(reduced, fixed, covariances(reduced)).noise
    conditional = reduced.conditional_covariance()
    expected = conditional @ equations.source @ conditional
    np.testing.assert_allclose(found, expected, atol=1e-7 * expected.max())
