import erfa
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.model.aberration import aberrate, inverse_lorentz_factor

HUNDREDTH_UAS = np.radians(0.01e-6 / 3600.0)


def apparent(direction, velocity, sun_distance):
    direction, velocity = np.atleast_2d(direction), np.atleast_2d(velocity)
    along = np.sum(direction * velocity, axis=-1)
    lorentz = inverse_lorentz_factor(jnp.asarray(velocity))
    moved = aberrate(
        tuple(jnp.asarray(direction.T)),
        tuple(jnp.asarray(velocity.T)),
        jnp.asarray(along),
        lorentz,
        jnp.array([sun_distance]),
    )
    moved = np.concatenate(moved)
    return moved / np.linalg.norm(moved)


angles = st.floats(0.0, 2.0 * np.pi)
latitudes = st.floats(-1.5, 1.5)


@settings(deadline=None, max_examples=60)
@given(angles, latitudes, angles, latitudes, st.floats(0.0, 2e-4), st.floats(0.98, 1.02))
def test_apparent_direction_agrees_with_erfa(ra, dec, v_ra, v_dec, speed, sun_distance):
    direction, velocity = erfa.s2c(ra, dec), speed * erfa.s2c(v_ra, v_dec)
    expected = erfa.ab(direction, velocity, sun_distance, np.sqrt(1.0 - velocity @ velocity))
    ours = apparent(direction, velocity, sun_distance)
    assert np.linalg.norm(ours - expected) < HUNDREDTH_UAS


def test_zero_velocity_changes_nothing():
    direction = erfa.s2c(1.0, -0.4)
    np.testing.assert_array_equal(apparent(direction, np.zeros(3), 1.0), direction)


def test_aberration_is_the_speed_times_the_sine_to_first_order():
    moved = apparent([0.0, 1.0, 0.0], [1e-4, 0.0, 0.0], 1.0)
    assert moved[0] == pytest.approx(1e-4, rel=1e-6)


def test_factor_is_the_inverse_of_the_lorentz_factor():
    np.testing.assert_allclose(inverse_lorentz_factor(jnp.array([[0.6, 0.0, 0.0]])), 0.8)
