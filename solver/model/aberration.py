"""Stellar aberration by the observer's velocity, as in ERFA's `ab`.

It is applied per exposure. If it were omitted, the quadratic distortion terms would absorb
it, up to 0.36 mas at the corners of the field.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

Components = tuple[Float[Array, "*#obs"], Float[Array, "*#obs"], Float[Array, "*#obs"]]

# Schwarzschild radius of the Sun, au: the gravitational term of Klioner (2003).
SUN_SCHWARZSCHILD_AU = 1.97412574336e-8


def aberrate(
    components: Components,
    velocity: Components,
    speed_along: Float[Array, "*#obs"],
    lorentz: Float[Array, "*#obs"],
    sun_distance: Float[Array, "*#obs"],
) -> Components:
    """Return apparent directions along the same axes, not normalised.

    Parameters
    ----------
    components : unit vectors towards the sources
    velocity : of the observer, in c, along the same axes
    speed_along : dot product of source direction and velocity, in c
    lorentz : sqrt(1 - v^2)
    sun_distance : of the observer, au
    """
    potential = SUN_SCHWARZSCHILD_AU / sun_distance
    on_source = lorentz - potential * speed_along
    on_velocity = 1.0 / (1.0 + lorentz) * speed_along + (1.0 + potential)
    x, y, z = (on_source * u + on_velocity * v for u, v in zip(components, velocity, strict=True))
    return x, y, z


def inverse_lorentz_factor(velocity: Float[Array, "exp 3"]) -> Float[Array, " exp"]:
    """Return sqrt(1 - v^2), the inverse of the Lorentz factor, for velocities in c."""
    return jnp.sqrt(1.0 - jnp.sum(velocity**2, axis=-1))
