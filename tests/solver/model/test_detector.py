import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.data.instrument import MINI_MOCK
from solver.model.detector import to_pixel
from tests.solver.small_orbit import detector_pixels

lengths = st.floats(-2e4, 2e4)


@settings(deadline=None, max_examples=30)
@given(lengths, lengths, lengths, lengths, st.floats(-7.0, 7.0), st.floats(5.0, 20.0))
def test_pixels_agree_with_the_papers_matrix(x, y, centre_x, centre_y, angle, pitch):
    expected = detector_pixels(x, y, centre_x, centre_y, angle, pitch, 1.1 * pitch)
    ours = to_pixel(
        (jnp.array([x]), jnp.array([y])),
        (jnp.array([centre_x]), jnp.array([centre_y])),
        jnp.array([angle]),
        (jnp.array([pitch]), jnp.array([1.1 * pitch])),
    )
    np.testing.assert_allclose(np.concatenate(ours), expected, atol=1e-9)


@pytest.mark.parametrize("detector", MINI_MOCK.detectors, ids=lambda d: str(d.detector_id))
def test_corners_of_a_detector_are_its_outermost_pixels(detector):
    place = (detector.x_um, detector.y_um), (detector.pitch_x_um, detector.pitch_y_um)
    centre, pitch = (tuple(jnp.array([value]) for value in pair) for pair in place)
    rotation = jnp.array([np.radians(detector.rotation_deg)])
    corners = tuple(jnp.asarray(detector.corners_um().T))
    pixels = np.stack(to_pixel(corners, centre, rotation, pitch), axis=-1)
    half = np.array([detector.n_x, detector.n_y]) / 2.0
    expected = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    np.testing.assert_allclose(pixels, expected, atol=1e-9)


def test_centre_of_the_detector_is_pixel_zero():
    place = (jnp.array([11_100.0]), jnp.array([-11_100.0]))
    pixels = to_pixel(place, place, jnp.array([0.3]), (jnp.array([10.0]), jnp.array([10.0])))
    np.testing.assert_array_equal(pixels, 0.0)
