"""What assets/docs/uncertainties.md derives, on a small orbit."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro.infer import Trace_ELBO

from solver.data.parameters import SOURCES
from solver.engines.guide import SITES, Means, guide
from solver.engines.numpyro_model import evidence_of, in_coordinates
from solver.linear.leverage import covariances
from solver.linear.source_elimination import eliminate_sources
from solver.linear.whitening import in_bare_units, whitened
from solver.results.diagnostics import error_budget, log_evidence

# Each source's axes with all combinations of signs: mean, variance and correlation are exact.
SIGNS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])


@pytest.fixture(scope="module")
def reduced_at_mode(solution):
    return replace(solution.reduced, at=(solution.mode.theta, solution.mode.sources))


@pytest.fixture(scope="module")
def loss(solution):
    """Return minus the evidence lower bound of a guide, as numpyro has it."""
    evidence = jax.device_put(evidence_of(solution.problem))
    shape = (2, solution.problem.n_src)

    @jax.jit
    def of(coordinates, means, signs):
        return Trace_ELBO().loss(
            jax.random.key(0),
            dict(zip(SITES, means, strict=True)),
            lambda: in_coordinates(evidence, coordinates),
            lambda: guide(means, jnp.broadcast_to(signs[:, None], shape)),
        )

    return lambda *at: np.mean([float(of(*at, signs)) for signs in SIGNS])


@pytest.fixture(scope="module")
def at_mode(solution):
    """Return the function that makes a guide at the mode, of some widths."""
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
def test_guide_rests_at_the_mode_with_the_inverse_of_each_sources_block(
    reduced_at_mode, loss, at_mode, site
):
    """In whitened coordinates a width of one is C_i = V_i^-1."""
    coordinates, means = whitened(reduced_at_mode), at_mode(1.0)
    signs = np.random.default_rng(site).choice([-1.0, 1.0], means[site].shape)
    up, down = (
        loss(coordinates, means._replace(**{means._fields[site]: means[site] + step * signs}))
        for step in (1e-3, -1e-3)
    )
    # Along a direction in which a guide off by a sigma would have a slope of its length.
    assert abs(up - down) / 2e-3 < 0.01 * np.sqrt(signs.size)
    assert up + down > 2.0 * loss(coordinates, means)


def test_width_one_is_the_conditional_covariance(reduced_at_mode, at_mode):
    found = whitened(reduced_at_mode).covariance(at_mode(1.0).scale)
    np.testing.assert_allclose(found, reduced_at_mode.conditional_covariance(), rtol=1e-9)


def test_independent_normals_rest_at_the_inverse_of_the_diagonal(
    solution, reduced_at_mode, loss, at_mode
):
    """The paper's guide, in the coordinates of the published code."""
    coordinates = in_bare_units(solution.problem.layout, reduced_at_mode.at)
    widths = independent_widths(reduced_at_mode)
    up, down = (loss(coordinates, at_mode(widths * (1.0 + step))) for step in (1e-3, -1e-3))
    assert abs(up - down) / 2e-3 < 1e-3 * widths.size
    # The small orbit's pixels are not measured alike in x and y, so that these are narrower.
    whole = np.diagonal(reduced_at_mode.conditional_covariance(), axis1=1, axis2=2).T
    shrunk = widths * SOURCES.per_value_unit / np.sqrt(whole)
    assert shrunk.max() <= 1.0 + 1e-9
    assert shrunk.min() < 0.98


def test_bound_falls_short_of_the_evidence_by_the_density_of_the_calibration(
    solution, reduced_at_mode, loss, at_mode
):
    """K/2 log 2 pi in whitened coordinates, where that density is the unit normal's."""
    problem = solution.problem
    evidence = log_evidence(
        solution.mode,
        problem.priors,
        float(np.log(problem.measurements.sigma).sum()),
        2 * problem.n_obs,
    )
    bound = -loss(whitened(reduced_at_mode), at_mode(1.0))
    deficit = 0.5 * problem.layout.size * np.log(2.0 * np.pi)
    assert evidence - bound == pytest.approx(deficit, abs=0.1)


def test_scatter_and_offset_make_up_the_whole_covariance(problem, reduced, dense):
    """H^-1 H_data H^-1 + H^-1 P H^-1 = H^-1, and so for every source's block."""
    sigma = np.sqrt(np.diag(dense.covariance))
    parts = (dense.jacobian.T @ dense.jacobian, dense.prior)
    total = sum(dense.covariance @ middle @ dense.covariance for middle in parts)
    scale = np.outer(sigma, sigma)
    np.testing.assert_allclose(total / scale, dense.covariance / scale, atol=1e-8)
    n = dense.n_calib
    whole = total[n:, n:].reshape(problem.n_src, 2, problem.n_src, 2)
    expected = whole[np.arange(problem.n_src), :, np.arange(problem.n_src), :]
    found = sum(error_budget(reduced, problem.priors, covariances(reduced)))
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_one_star_alone_scatters_by_its_own_share_of_the_data(problem, equations):
    """With the calibration held, the noise part is C_i V_i,data C_i: reported^2 / sigma_d."""
    held = problem.priors._replace(width=np.full_like(problem.priors.width, 1e-9))
    reduced = eliminate_sources(equations, held)
    found = error_budget(reduced, held, covariances(reduced)).noise
    conditional = reduced.conditional_covariance()
    expected = conditional @ equations.source @ conditional
    np.testing.assert_allclose(found, expected, atol=1e-7 * expected.max())
