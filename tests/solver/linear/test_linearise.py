import jax
import numpy as np
import pytest

from solver.linear.linearise import linearise, turning
from solver.model.forward import predict
from solver.problem.parameter_vector import PER_DETECTOR, PER_EXPOSURE
from tests.solver.small_orbit import observer_of, predict_pixels, true_offsets

_predict = jax.jit(predict)


def in_working_order(problem, weight, at):
    """Linearise all chunks and return the values of each measurement, in working order."""
    tiles, offsets = problem.measurements.tiles, problem.offsets(*at)
    turn, chunks = turning(offsets, problem.geometry), []
    for i in range(len(tiles.measured)):
        index, measured, _ = tiles.chunk(i)
        chunks.append(linearise(turn, offsets, problem.geometry, index, measured, weight[i]))
    joined = jax.tree.map(lambda *leaves: np.concatenate([np.ravel(p) for p in leaves]), *chunks)
    return jax.tree.map(lambda values: values[tiles.place], joined)


def pixels(problem, offsets):
    return np.stack(_predict(offsets, problem.geometry, problem.measurements.index).pixel, axis=-1)


@pytest.fixture
def linearised(problem, expansion_point):
    return in_working_order(problem, problem.measurements.tiles.weight, expansion_point)


def in_pixels(problem, pair):
    """Return a pair of whitened derivatives in pixels, one column each."""
    return np.stack(pair, axis=-1) * problem.measurements.sigma


def finite_difference(problem, point, group, element, step):
    """Return the derivative of the pixels when a whole parameter group moves."""
    moved = []
    for sign in (-1.0, 1.0):
        offsets = problem.offsets(*point)
        values = offsets[group].copy()
        values[(..., element) if group == "sources" else ...] += sign * step
        offsets[group] = values
        moved.append(pixels(problem, offsets))
    return (moved[1] - moved[0]) / (2 * step)


@pytest.mark.parametrize("axis", [0, 1], ids=["east", "north"])
def test_derivatives_by_sources_equal_finite_differences(
    problem, expansion_point, linearised, axis
):
    expected = finite_difference(problem, expansion_point, "sources", axis, 100.0)
    found = in_pixels(problem, linearised.source[axis])
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("name", [g.name for g in PER_EXPOSURE + PER_DETECTOR])
def test_derivatives_by_local_groups_equal_finite_differences(
    problem, expansion_point, linearised, name
):
    column = [g.name for g in PER_EXPOSURE + PER_DETECTOR].index(name)
    step = 1e-3 if name.startswith("pitch") else 1.0
    expected = finite_difference(problem, expansion_point, name, 0, step)
    found = in_pixels(problem, linearised.local[column])
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("axis", [0, 1], ids=["x", "y"])
def test_displacement_times_basis_is_the_derivative_by_the_coefficients(
    problem, expansion_point, linearised, axis
):
    group = f"distortion_{'xy'[axis]}"
    found = in_pixels(problem, linearised.displacement[axis])
    for term in range(problem.layout.n_coef):
        moved = []
        for step in (-1.0, 1.0):
            offsets = problem.offsets(*expansion_point)
            offsets[group] = offsets[group] + step * np.eye(problem.layout.n_coef)[term]
            moved.append(pixels(problem, offsets))
        expected = 0.5 * (moved[1] - moved[0])
        basis = linearised.prediction.basis[term][:, None]
        np.testing.assert_allclose(found * basis, expected, atol=1e-9)


def test_all_derivatives_equal_those_of_the_whole_model(problem, linearised, dense):
    """The reference is the Jacobian of `predict` by all parameters."""
    layout, jacobian = problem.layout, dense.jacobian.reshape(problem.n_obs, 2, -1)
    source, exposure, detector = problem.measurements.index
    columns = layout.touched(exposure, detector).T
    expected_columns = [*zip(linearised.local, columns, strict=True)]
    expected_columns += [(linearised.source[a], layout.size + 2 * source + a) for a in range(2)]
    for pair, column in expected_columns:
        expected = jacobian[np.arange(problem.n_obs), :, column]
        found = np.stack(pair, axis=-1)
        np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


def test_residual_is_measured_minus_predicted_over_sigma(small_orbit, problem):
    at = in_working_order(
        problem, problem.measurements.tiles.weight, true_offsets(small_orbit, problem)
    )
    truth = predict_pixels(
        small_orbit.truth,
        small_orbit.source,
        small_orbit.exposure,
        small_orbit.detector,
        observer_of(small_orbit.data.exposures, aberration=True),
        small_orbit.instrument.distortion_scale_um,
    )[problem.measurements.row]
    expected = (problem.measurements.measured - truth) / problem.measurements.sigma
    np.testing.assert_allclose(np.stack(at.residual, axis=-1), expected, atol=1e-5)


def test_zero_weight_removes_a_coordinate(problem, expansion_point):
    weight = problem.measurements.tiles.weight.copy()
    chunk, tile, slot = np.unravel_index(
        problem.measurements.tiles.place[3], problem.measurements.tiles.index.source.shape
    )
    weight[chunk, 1, tile, slot] = 0.0
    at = in_working_order(problem, weight, expansion_point)
    for _, y in (at.residual, *at.source, *at.local, *at.displacement):
        assert y[3] == 0.0
    for x, _ in (at.residual, *at.source):
        assert abs(x[3]) > 0.0
