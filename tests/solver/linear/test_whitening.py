import numpy as np
import pytest

from solver.data.settings import FitSettings
from solver.engines.curvature import curvature_at
from solver.engines.gauss_newton import find_mode, objective
from solver.linear.chi2 import gradient
from solver.linear.normal_equations import accumulate
from solver.linear.source_elimination import eliminate_sources
from solver.linear.whitening import in_bare_units, whitened
from solver.problem.problem import build_problem


@pytest.fixture(scope="module")
def reduced(problem, expansion_point):
    return eliminate_sources(accumulate(problem, *expansion_point), problem.priors)


def placed(coordinates, flat, n_theta):
    """Return the parameters of flat free coordinates as one vector relative to the origin."""
    theta, sources = coordinates.place(flat[:n_theta], flat[n_theta:].reshape(2, -1))
    return np.concatenate(
        [theta - coordinates.origin[0], np.ravel(sources - coordinates.origin[1])]
    )


def test_whitened_posterior_has_unit_covariance(reduced, problem, dense):
    coordinates, n_theta = whitened(reduced), problem.layout.size
    size = n_theta + 2 * problem.n_src
    jacobian = np.stack([placed(coordinates, unit, n_theta) for unit in np.eye(size)], axis=1)
    np.testing.assert_allclose(jacobian.T @ dense.hessian @ jacobian, np.eye(size), atol=1e-6)
    logarithm = np.linalg.slogdet(jacobian)[1]
    assert float(coordinates.log_volume) == pytest.approx(logarithm, abs=1e-6)


def test_covariance_of_unit_scatter_equals_the_conditional_one(reduced, problem):
    found = whitened(reduced).covariance(np.ones((2, problem.n_src)))
    np.testing.assert_allclose(found, reduced.conditional_covariance(), rtol=1e-12)


def test_bare_units_are_degrees_and_micrometres(problem):
    layout = problem.layout
    at = np.zeros(layout.size), np.zeros((problem.n_src, 2))
    theta, sources = in_bare_units(layout, at).place(
        np.ones(layout.size), np.ones((2, problem.n_src))
    )
    values = layout.scatter(np.asarray(theta))
    np.testing.assert_allclose(sources, 3.6e6)
    np.testing.assert_allclose(values["pointing_ra"], 3600.0)
    np.testing.assert_allclose(values["detector_x"], 1.0)


def test_curvature_follows_the_posterior_along_weak_directions(small_orbit):
    """Along weak directions the objective rises as expected only with the second-order term."""
    settings = FitSettings()
    problem = build_problem(small_orbit.data, small_orbit.instrument, settings)
    mode = find_mode(problem, settings)
    reduced = eliminate_sources(accumulate(problem, mode.theta, mode.sources), problem.priors)
    curvature = curvature_at(problem, mode, reduced)

    def objective_at(theta, sources):
        at = gradient(problem, np.asarray(theta), np.asarray(sources))
        return objective(problem, np.asarray(theta), np.asarray(sources), at)

    lowest = objective_at(mode.theta, mode.sources)
    displacement = reduced.theta_covariance() @ curvature.weak.T
    follow = -np.einsum("kas,kw->wsa", reduced.response(), displacement)[
        :, reduced.source_blocks.position
    ]
    for i in range(len(curvature.weak)):
        straight = mode.theta + displacement[:, i], mode.sources + follow[i]
        correction = curvature.at(displacement[:, i])
        corrected = [a + np.asarray(b) for a, b in zip(straight, correction, strict=True)]
        expected = float(curvature.weak[i] @ displacement[:, i])
        assert objective_at(*corrected) - lowest == pytest.approx(expected, abs=0.2)
