"""Fixtures: a small orbit, its solution, and its posterior as a dense matrix."""

from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg as sl

from solver.data.parameters import SOURCES
from solver.data.settings import FitSettings
from solver.engines.estimate import Estimate
from solver.engines.gauss_newton import find_mode
from solver.fit import fit_orbit
from solver.io.read_orbit import read_orbit
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import eliminate_sources
from solver.model.forward import predict
from solver.problem.problem import build_problem
from solver.problem.tiles import CHUNK as WHOLE_CHUNK
from solver.results.tables import solved_problem
from tests.solver.small_orbit import make_orbit, true_offsets

# Tiles per chunk; the same in all tests, since each length is compiled. A small orbit has two.
CHUNK = 16


@pytest.fixture(scope="package", autouse=True)
def _small_chunks():
    """Linearise a small orbit in more than one chunk."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("solver.problem.tiles.CHUNK", CHUNK)
        yield


@pytest.fixture(scope="package", autouse=True)
def _small_patches():
    """Keep the fields of a small orbit in separate blocks, although it is too small to benefit."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("solver.problem.source_blocks.BLOCK_OVERHEAD", 0.0)
        yield


@pytest.fixture(scope="module")
def optimised():
    """Compile with all optimisations, for tests with long computations."""
    before = jax.config.values["jax_disable_most_optimizations"]
    jax.config.update("jax_disable_most_optimizations", False)
    yield
    jax.config.update("jax_disable_most_optimizations", before)


@pytest.fixture(scope="package")
def small_orbit():
    """Two fields of four exposures on four detectors, with the paper's aberration."""
    return make_orbit()


# With the default priors the common shift, roll and scale of the detectors are so weakly
# constrained that a dense inverse is accurate to only seven digits.
TIGHT_PRIORS = {
    "detector_x": 10.0,
    "detector_y": 10.0,
    "detector_rotation": 60.0,
    "pitch_x": 1e-3,
    "pitch_y": 1e-3,
}


@pytest.fixture(scope="package")
def problem(small_orbit):
    """The problem of the small orbit, with tighter priors of the detectors than by default."""
    settings = FitSettings(prior_widths=TIGHT_PRIORS)
    return build_problem(small_orbit.data, small_orbit.instrument, settings)


def solve(orbit, settings=None):
    """Return the `SolvedProblem` of a small orbit."""
    settings = settings or FitSettings()
    problem = build_problem(orbit.data, orbit.instrument, settings)
    mode = find_mode(problem, settings)
    return solved_problem(problem, Estimate(mode), mode.reduced)


@pytest.fixture(scope="package")
def solution(small_orbit):
    return solve(small_orbit)


@pytest.fixture(scope="package")
def result(small_orbit):
    """The result of the small orbit."""
    return fit_orbit(small_orbit.data, small_orbit.instrument)


@pytest.fixture(scope="package")
def mocks():
    """Truth and solution of orbits with all parameters drawn from their priors."""
    orbits = [make_orbit(seed=seed, scatter=1.0) for seed in range(100, 116)]
    return [(orbit, solve(orbit)) for orbit in orbits]


@pytest.fixture(scope="package")
def sample_orbit(sample_orbit_dir):
    """The tables of the sample orbit."""
    return read_orbit(
        sample_orbit_dir / "sample_obs.fits",
        sample_orbit_dir / "sample_ref.fits",
        sample_orbit_dir / "sample_truth.fits",
    )


class Dense(NamedTuple):
    """Whitened Jacobian, Hessian with priors and its inverse; calibration parameters first.

    `jacobian` has one row per coordinate, in the order of the problem; `gradient` is minus
    the gradient of half the penalised chi2.
    """

    residual: np.ndarray
    jacobian: np.ndarray
    prior: np.ndarray
    hessian: np.ndarray
    gradient: np.ndarray
    covariance: np.ndarray
    n_calib: int


@jax.jit
def _pixels(offsets, geometry, index):
    return jnp.stack(predict(offsets, geometry, index).pixel, axis=-1)


@jax.jit
def _dense_jacobian(offsets, geometry, index):
    return jax.jacfwd(lambda values: _pixels(values, geometry, index))(offsets)


def dense_jacobian(problem, theta, sources):
    """Return the Jacobian of all pixels, shape (2 obs, parameters)."""
    offsets = {**problem.layout.scatter(theta), SOURCES.name: sources}
    blocks = _dense_jacobian(offsets, unpadded(problem), problem.measurements.index)
    n_rows = 2 * problem.n_obs
    jacobian = np.zeros((n_rows, problem.layout.size + sources.size))
    for group in problem.layout.groups:
        block = np.asarray(blocks[group.name])
        jacobian[:, problem.layout.columns(group)] = block.reshape(n_rows, -1)
    jacobian[:, problem.layout.size :] = np.asarray(blocks[SOURCES.name]).reshape(n_rows, -1)
    return jacobian


def unpadded(problem):
    """Return the geometry without padded sources and exposures."""
    geometry, n_exp = problem.geometry, problem.layout.n_exp
    lengths = problem.layout.lengths
    return replace(
        geometry,
        source_frame=geometry.source_frame[: problem.n_src],
        pointing_frame=geometry.pointing_frame[:n_exp],
        origin={
            group.name: geometry.origin[group.name][: lengths.get(group.axis)]
            for group in problem.layout.groups
            if group.name in geometry.origin
        },
        velocity=geometry.velocity[:n_exp],
        sun_distance=geometry.sun_distance[:n_exp],
    )


def matrix_root(matrix):
    """Return R with R'R = `matrix`, which may be singular."""
    values, vectors = np.linalg.eigh(matrix)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def inverse_of_normal(jacobian):
    """Return (J'J)^-1 by QR of J, whose condition number is the square root of that of J'J."""
    scale = 1.0 / np.linalg.norm(jacobian, axis=0)
    triangle = np.linalg.qr(jacobian * scale, mode="r")
    root = sl.solve_triangular(triangle, np.eye(len(scale))) * scale[:, None]
    return root @ root.T


@pytest.fixture(scope="package")
def make_dense():
    """Return the function that builds the dense posterior of a problem at a point."""

    def make(problem, theta, sources):
        weight = 1.0 / problem.measurements.sigma.ravel()
        jacobian = dense_jacobian(problem, theta, sources) * weight[:, None]
        predicted = _pixels(
            problem.offsets(theta, sources), problem.geometry, problem.measurements.index
        )
        residual = (problem.measurements.measured - np.asarray(predicted)).ravel() * weight
        n_calib = problem.layout.size
        prior = np.zeros((jacobian.shape[1],) * 2)
        prior[:n_calib, :n_calib] = problem.priors.with_hessian(np.zeros((n_calib, n_calib)), theta)
        for i, precision in enumerate(problem.priors.precision):
            here = slice(n_calib + 2 * i, n_calib + 2 * i + 2)
            prior[here, here] = precision
        hessian = jacobian.T @ jacobian + prior
        gradient = jacobian.T @ residual
        gradient[:n_calib] -= problem.priors.gradient(theta)
        gradient[n_calib:] -= prior[n_calib:, n_calib:] @ sources.ravel()
        covariance = inverse_of_normal(np.vstack([jacobian, matrix_root(prior)]))
        return Dense(residual, jacobian, prior, hessian, gradient, covariance, n_calib)

    return make


@pytest.fixture(scope="package")
def expansion_point(small_orbit, problem):
    """The truth: about one sigma from the mode, and with no parameter at its origin."""
    return true_offsets(small_orbit, problem)


@pytest.fixture(scope="package")
def dense(problem, expansion_point, make_dense):
    """The dense posterior of the small orbit at `expansion_point`."""
    return make_dense(problem, *expansion_point)


@pytest.fixture
def equations(problem, expansion_point):
    return accumulate(problem, *expansion_point)


@pytest.fixture
def reduced(problem, equations, expansion_point):
    return eliminate_sources(equations, problem.priors)


@pytest.fixture
def fit():
    """Return the function that fits a small orbit with given settings."""

    def run(orbit, **settings):
        return fit_orbit(orbit.data, orbit.instrument, FitSettings(**settings))

    return run


@pytest.fixture(scope="package")
def fit_whole():
    """Return the function that fits an orbit of full size, with chunks of normal length."""

    def run(data, settings=None):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("solver.problem.tiles.CHUNK", WHOLE_CHUNK)
            return fit_orbit(data, settings=settings or FitSettings())

    return run


@pytest.fixture
def with_tables():
    """Return the function that replaces tables of a small orbit."""

    def change(orbit, **tables):
        return orbit._replace(data=replace(orbit.data, **tables))

    return change
