import jax
import numpy as np
import pytest

from solver.forward import predict
from solver.layout import PER_DETECTOR, PER_EXPOSURE
from solver.linearise import linearise
from tests.solver.small_orbit import observer_of, predict_pixels, true_offsets

_predict = jax.jit(predict)


@pytest.fixture
def linearised(problem, expansion_point):
    offsets = problem.offsets(*expansion_point)
    return linearise(
        offsets, problem.geometry, problem.index, problem.measured, 1.0 / problem.sigma
    )


def finite_difference(problem, point, group, element, step):
    """Return the derivative of the pixels by one parameter group moved as a whole."""
    moved = []
    for sign in (-1.0, 1.0):
        offsets = problem.offsets(*point)
        values = offsets[group].copy()
        values[(..., element) if group == "sources" else ...] += sign * step
        offsets[group] = values
        moved.append(np.asarray(_predict(offsets, problem.geometry, problem.index).pixel))
    return (moved[1] - moved[0]) / (2 * step)


@pytest.mark.parametrize("axis", [0, 1], ids=["east", "north"])
def test_derivatives_by_sources_are_finite_differences(problem, expansion_point, linearised, axis):
    expected = finite_difference(problem, expansion_point, "sources", axis, 100.0)
    found = np.asarray(linearised.source)[:, :, axis] * problem.sigma
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("name", [g.name for g in PER_EXPOSURE])
def test_derivatives_by_exposures_are_finite_differences(
    problem, expansion_point, linearised, name
):
    column = [g.name for g in PER_EXPOSURE].index(name)
    expected = finite_difference(problem, expansion_point, name, 0, 1.0)
    found = np.asarray(linearised.exposure)[:, :, column] * problem.sigma
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("name", [g.name for g in PER_DETECTOR])
def test_derivatives_by_detectors_are_finite_differences(
    problem, expansion_point, linearised, name
):
    column = [g.name for g in PER_DETECTOR].index(name)
    step = 1e-3 if name.startswith("pitch") else 1.0
    expected = finite_difference(problem, expansion_point, name, 0, step)
    found = np.asarray(linearised.detector)[:, :, column] * problem.sigma
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("axis", [0, 1], ids=["x", "y"])
def test_displacement_times_basis_is_the_derivative_by_the_coefficients(
    problem, expansion_point, linearised, axis
):
    group = f"distortion_{'xy'[axis]}"
    found = np.asarray(linearised.displacement)[:, :, axis] * problem.sigma
    for term in range(problem.layout.n_coef):
        moved = []
        for step in (-1.0, 1.0):
            offsets = problem.offsets(*expansion_point)
            offsets[group] = offsets[group] + step * np.eye(problem.layout.n_coef)[term]
            moved.append(np.asarray(_predict(offsets, problem.geometry, problem.index).pixel))
        expected = 0.5 * (moved[1] - moved[0])
        basis = np.asarray(linearised.prediction.basis)[:, term, None]
        np.testing.assert_allclose(found * basis, expected, atol=1e-9)


def test_all_derivatives_are_those_of_the_whole_model(problem, linearised, dense):
    """Against the Jacobian of `predict` by all parameters at once."""
    layout, jacobian = problem.layout, dense.jacobian.reshape(problem.n_obs, 2, -1)
    source, exposure, detector = problem.index
    rows = np.arange(problem.n_obs)
    for part, first, count, element in (
        (linearised.source, layout.size, 2, source),
        (linearised.exposure, 0, 4, exposure),
        (linearised.detector, layout.first_detector, 5, detector),
    ):
        for i in range(count):
            expected = jacobian[rows, :, first + count * element + i]
            np.testing.assert_allclose(
                np.asarray(part)[:, :, i], expected, atol=1e-11 * np.abs(expected).max()
            )


def test_residual_is_measured_minus_predicted_over_sigma(small_orbit, problem):
    offsets = problem.offsets(*true_offsets(small_orbit, problem))
    at = linearise(offsets, problem.geometry, problem.index, problem.measured, 1.0 / problem.sigma)
    truth = predict_pixels(
        small_orbit.truth,
        small_orbit.source,
        small_orbit.exposure,
        small_orbit.detector,
        observer_of(small_orbit.data.exposures, aberration=True),
        small_orbit.instrument.distortion_scale_um,
    )[problem.row]
    expected = (problem.measured - truth) / problem.sigma
    np.testing.assert_allclose(at.residual, expected, atol=1e-5)


def test_zero_weight_removes_a_coordinate(problem, expansion_point):
    weight = 1.0 / problem.sigma
    weight[3, 1] = 0.0
    offsets = problem.offsets(*expansion_point)
    at = linearise(offsets, problem.geometry, problem.index, problem.measured, weight)
    for values in (at.residual, at.source, at.exposure, at.detector, at.displacement):
        np.testing.assert_array_equal(np.asarray(values)[3, 1], 0.0)
        assert np.abs(np.asarray(values)[3, 0]).max() > 0.0
