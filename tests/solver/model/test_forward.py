from dataclasses import replace

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.data.parameters import CALIBRATION_GROUPS
from solver.data.settings import FitSettings
from solver.model.forward import Index, Prediction, directions, ideal_position, image, predict
from solver.problem.problem import build_problem
from tests.solver.small_orbit import make_orbit, true_offsets

# 1e-7 pixel is 0.04 uas.
PIXEL = 1e-7


_predict = jax.jit(predict)


def predicted(problem, theta, sources):
    """Predict with the same shapes for all orbits, to avoid recompilation."""
    take = np.minimum(np.arange(512), problem.n_obs - 1)
    index = Index(*(column[take] for column in problem.measurements.index))
    at = _predict(problem.offsets(theta, sources), problem.geometry, index)
    return Prediction(*(np.stack(part, axis=-1)[: problem.n_obs] for part in at))


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"ra": 0.05},
        {"ra": 359.98, "dec": 70.0},
        {"aberration": False},
        {"velocity": 7.6},
        {"max_degree": 9},
        {"scatter": 1.0, "pointing_error": 200.0},
    ],
    ids=["paper", "zero-hours", "high-dec", "no-aberration", "satellite", "order-9", "far-off"],
)
def test_prediction_agrees_with_the_papers_equations(changes):
    orbit = make_orbit(**changes)
    settings = FitSettings(
        order=changes.get("max_degree", 5), aberration=changes.get("aberration", True)
    )
    problem = build_problem(orbit.data, orbit.instrument, settings)
    pixels = predicted(problem, *true_offsets(orbit, problem)).pixel
    np.testing.assert_allclose(pixels, orbit.pixels[problem.measurements.row], atol=PIXEL)


def test_prediction_includes_ideal_and_focal_positions(problem, expansion_point):
    at = predicted(problem, *expansion_point)
    values = problem.layout.scatter(expansion_point[0])
    coefficients = np.stack([values["distortion_x"], values["distortion_y"]], axis=-1)
    np.testing.assert_allclose(at.focal - at.ideal, at.basis @ coefficients, atol=1e-8)


def test_displacement_is_added_on_the_focal_plane(problem, expansion_point):
    arguments = (problem.offsets(*expansion_point), problem.geometry, problem.measurements.index)
    ideal = jax.jit(ideal_position)(jax.jit(directions)(*arguments[:2]), *arguments)
    still, moved = (jax.jit(image)(ideal, *arguments, by) for by in ((0.0, 0.0), (2.0, -3.0)))
    for axis, shift in enumerate((2.0, -3.0)):
        np.testing.assert_allclose(moved.focal[axis] - still.focal[axis], shift, atol=1e-8)
        np.testing.assert_array_equal(moved.ideal[axis], still.ideal[axis])


def test_order_padded_with_zeros_predicts_the_same(small_orbit, problem, expansion_point):
    theta, sources = expansion_point
    higher = build_problem(small_orbit.data, small_orbit.instrument, FitSettings(order=7))
    values = problem.layout.scatter(theta)
    padded = {name: np.zeros(higher.layout.n_coef) for name in ("distortion_x", "distortion_y")}
    for name, coefficients in padded.items():
        coefficients[: problem.layout.n_coef] = values[name]
    flat = higher.layout.gather({**values, **padded})
    expected = predicted(problem, theta, sources).pixel
    np.testing.assert_allclose(predicted(higher, flat, sources).pixel, expected, atol=1e-9)


@pytest.mark.parametrize("name", [g.name for g in CALIBRATION_GROUPS])
def test_every_group_moves_the_prediction(problem, name):
    sizes = {g.name: len(problem.layout.columns(g)) for g in CALIBRATION_GROUPS}
    zero = {n: np.zeros(size) for n, size in sizes.items()}
    sources = np.zeros((problem.n_src, 2))
    still = predicted(problem, problem.layout.gather(zero), sources).pixel
    zero[name] = np.ones(sizes[name])
    moved = predicted(problem, problem.layout.gather(zero), sources).pixel
    assert np.abs(moved - still).max() > 1e-4


def test_every_group_of_the_table_is_an_offset_of_the_model(problem, expansion_point):
    assert set(problem.offsets(*expansion_point)) == {
        "sources",
        *(g.name for g in CALIBRATION_GROUPS),
    }


def test_common_rotation_of_sky_and_pointing_changes_nothing(problem, expansion_point):
    """Rotation about the pole, including the velocity."""
    turn = Rotation.from_euler("z", 37.0, degrees=True).as_matrix()
    geometry = replace(
        problem.geometry,
        source_frame=problem.geometry.source_frame @ turn.T,
        pointing_frame=problem.geometry.pointing_frame @ turn.T,
        velocity=problem.geometry.velocity @ turn.T,
    )
    turned = replace(problem, geometry=geometry)
    expected = predicted(problem, *expansion_point).pixel
    np.testing.assert_allclose(predicted(turned, *expansion_point).pixel, expected, atol=1e-8)


def test_prediction_is_float64(problem, expansion_point):
    assert jax.config.jax_enable_x64
    assert predicted(problem, *expansion_point).pixel.dtype == np.float64
