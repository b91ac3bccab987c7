"""Sky to the ideal focal plane: displaced directions, pointing axes, gnomonic projection.

Paper, section "Observation model", Eqs. (method:projection) and (method:ideal), written
with unit vectors: trigonometric functions are computed per source and per exposure, and
each measurement needs only three dot products.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


def displace(
    frame: Float[Array | np.ndarray, "n 3 3"],
    east: Float[Array | np.ndarray, " n"],
    north: Float[Array | np.ndarray, " n"],
) -> Float[Array, "n 3"]:
    """Return unit vectors displaced in the tangent plane of their frames.

    Parameters
    ----------
    frame : as from `directions.tangent_frame`
    east, north : rad
    """
    moved = frame[:, 0] + east[:, None] * frame[:, 1] + north[:, None] * frame[:, 2]
    return moved / jnp.linalg.norm(moved, axis=-1, keepdims=True)


def focal_axes(
    centre: Float[Array, "exp 3"], position_angle: Float[Array, " exp"]
) -> Float[Array, "exp 3 3"]:
    """Return the axes of the focal plane on the sky: x, y and the optical axis.

    Eq. (method:ideal) as vectors: with east E and north N at the pointing,
    x = -cos(theta) E + sin(theta) N and y = sin(theta) E + cos(theta) N.

    Parameters
    ----------
    centre : unit vectors of the pointings
    position_angle : rad
    """
    # East is the cross product of the pole and the direction; its third component is zero.
    east = jnp.stack([-centre[:, 1], centre[:, 0], jnp.zeros_like(centre[:, 0])], axis=-1)
    east = east / jnp.linalg.norm(east, axis=-1, keepdims=True)
    north = jnp.cross(centre, east)
    c, s = jnp.cos(position_angle)[:, None], jnp.sin(position_angle)[:, None]
    return jnp.stack([-c * east + s * north, s * east + c * north, centre], axis=-2)


def project(
    components: tuple[Float[Array, "*obs"], Float[Array, "*obs"], Float[Array, "*obs"]],
    focal_length: Float[Array, "*#obs"],
) -> tuple[Float[Array, "*obs"], Float[Array, "*obs"]]:
    """Project directions onto the ideal focal plane, Eqs. (method:projection, method:ideal).

    Parameters
    ----------
    components : x, y and z along the axes of `focal_axes`; vectors of any length
    focal_length : um

    Returns
    -------
    x and y, um, origin on the optical axis
    """
    x, y, z = components
    scale = focal_length / z
    return scale * x, scale * y
