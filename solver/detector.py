"""Distorted focal plane to detector pixels, paper Eq. (exp:model:nxny)."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def to_pixel(
    focal: Float[Array, "obs 2"],
    centre: Float[Array, "obs 2"],
    rotation: Float[Array, " obs"],
    pitch: Float[Array, "obs 2"],
) -> Float[Array, "obs 2"]:
    """Return detector coordinates of positions on the distorted focal plane.

    Parameters
    ----------
    focal : um
    centre : place of the detector's centre, um
    rotation : rad
    pitch : pixel pitch along the detector's axes, um

    Returns
    -------
    pixels from the detector's centre
    """
    x, y = (focal - centre).T
    c, s = jnp.cos(rotation), jnp.sin(rotation)
    return jnp.stack([c * x - s * y, s * x + c * y], axis=-1) / pitch
