"""Walks: the change of variables, and the priors in it, against dense matrices."""

import numpy as np
import pytest

from solver.data.settings import FitSettings
from solver.problem.problem import build_problem
from solver.problem.walks import MEAN_WIDTH_UM, NO_WALKS, Walks

# Two walks of four exposures among ten parameters.
WALKS = Walks(np.array([[7, 1, 4, 2], [9, 0, 3, 5]]))
RNG = np.random.default_rng(0)
WIDTH = RNG.uniform(0.5, 2.0, 10)


@pytest.fixture
def matrix():
    return WALKS.independent(np.eye(10))


def test_mean_and_steps_replace_the_elements():
    values = np.arange(10.0)
    found = WALKS.independent(values)
    np.testing.assert_allclose(found[[7, 1, 4, 2]], [3.5, -6.0, 3.0, -2.0])
    np.testing.assert_array_equal(found[[6, 8]], [6.0, 8.0])


def test_the_change_of_variables_keeps_volumes(matrix):
    assert abs(np.linalg.det(matrix)) == pytest.approx(1.0)


def test_methods_are_those_of_the_matrix(matrix):
    values = RNG.standard_normal(10)
    np.testing.assert_allclose(WALKS.transposed(values), matrix.T @ values)
    root = RNG.standard_normal((10, 10))
    covariance = root @ root.T
    np.testing.assert_allclose(WALKS.variances(covariance), np.diag(matrix @ covariance @ matrix.T))
    dense = matrix.T @ np.diag(WIDTH) @ matrix
    for columns, found in zip(WALKS.columns, WALKS.hessian(WIDTH), strict=True):
        np.testing.assert_allclose(found, dense[np.ix_(columns, columns)], atol=1e-12)
    inverse = np.linalg.inv(matrix)
    expected = np.sqrt(np.diag(inverse @ np.diag(WIDTH**2) @ inverse.T))
    np.testing.assert_allclose(WALKS.sigmas(WIDTH), expected)


def test_without_a_walk_nothing_is_copied():
    values = np.arange(3.0)
    for method in (NO_WALKS.independent, NO_WALKS.transposed, NO_WALKS.sigmas):
        assert method(values) is values


@pytest.fixture(scope="module")
def walking(small_orbit):
    settings = FitSettings(drift_walk=2, prior_widths={"drift_walk_y": 0.3})
    return build_problem(small_orbit.data, small_orbit.instrument, settings)


def test_walks_are_in_order_of_time(walking):
    time = walking.exposures["obstime"].to_numpy()
    columns = walking.priors.walks.columns
    assert columns.shape == (6, len(time))
    of_column = {c: m for m in range(len(time)) for c in walking.layout.walked(np.array(m))}
    for walk in columns:
        assert np.all(np.diff([time[of_column[c]] for c in walk]) > 0.0)


def test_priors_are_those_of_the_settings(walking):
    walks, width = walking.priors.walks, walking.priors.width
    np.testing.assert_array_equal(width[walks.columns[:, 0]], MEAN_WIDTH_UM)
    np.testing.assert_array_equal(width[walks.columns[:3, 1:]], 0.01)
    np.testing.assert_array_equal(width[walks.columns[3:, 1:]], 0.3)


def test_penalty_gradient_and_hessian_belong_together(walking):
    priors, size = walking.priors, walking.layout.size
    theta, sources = 1e-3 * RNG.standard_normal(size), np.zeros((walking.n_src, 2))
    step = np.zeros(size)
    step[priors.walks.columns] = 1e-4 * RNG.standard_normal(priors.walks.columns.shape)
    half = [0.5 * priors.penalty(theta + sign * step, sources) for sign in (-1.0, 0.0, 1.0)]
    assert priors.gradient(theta) @ step == pytest.approx(0.5 * (half[2] - half[0]), rel=1e-6)
    hessian = priors.with_hessian(np.zeros((size, size)), theta)
    assert step @ hessian @ step == pytest.approx(half[2] - 2.0 * half[1] + half[0], rel=1e-6)
    assert np.sum(priors.scaled(step[:, None], theta) ** 2) == pytest.approx(step @ hessian @ step)


def test_shares_of_the_priors_are_those_of_the_matrix(walking):
    priors, size = walking.priors, walking.layout.size
    root = RNG.standard_normal((size, size))
    covariance, theta = root @ root.T, np.zeros(size)
    expected = np.diag(priors.with_hessian(np.zeros((size, size)), theta) @ covariance)
    found = priors.shares(theta, np.diag(covariance), covariance)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-6)


def test_widths_of_means_are_those_of_another_array():
    before = np.full(10, 0.3)
    after = WALKS.with_widths_of_means(before)
    assert np.all(before == 0.3)
    np.testing.assert_array_equal(np.flatnonzero(after == MEAN_WIDTH_UM), [7, 9])
    np.testing.assert_array_equal(after[[0, 1, 2, 3, 4, 5, 6, 8]], 0.3)
