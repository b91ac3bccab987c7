"""Distorted focal plane to detector pixels, paper Eq. (exp:model:nxny)."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def to_pixel(
    focal: tuple[Float[Array, "*obs"], Float[Array, "*obs"]],
    centre: tuple[Float[Array, "*#obs"], Float[Array, "*#obs"]],
    rotation: Float[Array, "*#obs"],
    pitch: tuple[Float[Array, "*#obs"], Float[Array, "*#obs"]],
) -> tuple[Float[Array, "*obs"], Float[Array, "*obs"]]:
    """Return the detector coordinates of positions on the distorted focal plane.

    Parameters
    ----------
    focal : x and y, um
    centre : position of the detector's centre, um
    rotation : rad
    pitch : pixel pitch along the detector's axes, um

    Returns
    -------
    x and y, pixels from the detector's centre
    """
    x, y = focal[0] - centre[0], focal[1] - centre[1]
    c, s = jnp.cos(rotation), jnp.sin(rotation)
    # The parenthesised factors are per detector, only the products are per measurement.
    return (c / pitch[0]) * x - (s / pitch[0]) * y, (s / pitch[1]) * x + (c / pitch[1]) * y
