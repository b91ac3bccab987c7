"""The one observation model: parameters and geometry in, pixel positions out.

Paper, section "Observation model". Parameters are offsets from the origins kept in
`Geometry`, in the units of `solver.parameters`; a new parameter group is an entry there
and a term here. Simulator, engines and diagnostics all call `predict`.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from solver.aberration import aberrate, lorentz_factor
from solver.detector import to_pixel
from solver.distortion import basis
from solver.projection import displace, focal_axes, project
from solver.units import RAD_PER_ARCSEC, RAD_PER_MAS

# A NumPy or a JAX array: tables come as the one, what is computed from them is the other.
AnyArray = Any
Offsets = Mapping[str, AnyArray]


class Geometry(eqx.Module):
    """The origins from which the parameters are offsets, and what is not a parameter.

    Attributes
    ----------
    source_frame : direction, east and north at each source's origin
    pointing_frame : the same at each exposure's origin
    origin : group name -> whole value at offset zero, in the group's unit; every group but
        the sources and the pointing, whose origins are the frames
    velocity : of the observer, in c; zero switches aberration off
    sun_distance : of the observer, au
    distortion_scale : 1/s, um
    order : highest degree of the distortion
    """

    source_frame: Float[AnyArray, "src 3 3"]
    pointing_frame: Float[AnyArray, "exp 3 3"]
    origin: dict[str, Float[AnyArray, " _"]]
    velocity: Float[AnyArray, "exp 3"]
    sun_distance: Float[AnyArray, " exp"]
    distortion_scale: Float[AnyArray, ""]
    order: int = eqx.field(static=True)

    def value(self, offsets: Offsets, name: str) -> Float[Array, " _"]:
        """Return the whole value of a group, in its unit."""
        return self.origin[name] + offsets[name]


class Index(NamedTuple):
    """Which source, exposure and detector each measurement belongs to."""

    source: Int[AnyArray, " obs"]
    exposure: Int[AnyArray, " obs"]
    detector: Int[AnyArray, " obs"]


class Prediction(NamedTuple):
    """Where each measurement should lie.

    `ideal` and `focal` are on the undistorted and distorted focal plane, um; `pixel` is
    from the detector's centre; `basis` holds the value of each distortion term.
    """

    ideal: Float[AnyArray, "obs 2"]
    focal: Float[AnyArray, "obs 2"]
    pixel: Float[AnyArray, "obs 2"]
    basis: Float[AnyArray, "obs coef"]


def predict(offsets: Offsets, geometry: Geometry, index: Index) -> Prediction:
    """Predict the measurements of `index`.

    Parameters
    ----------
    offsets : group name -> offsets in the group's unit; "sources" is (src, 2), the others
        have one value per element of their axis
    """
    return image(ideal_position(offsets, geometry, index), offsets, geometry, index)


def ideal_position(offsets: Offsets, geometry: Geometry, index: Index) -> Float[Array, "obs 2"]:
    """Return positions on the undistorted focal plane, um."""
    focal_length = geometry.value(offsets, "focal_length")[index.exposure]
    return project(_apparent(offsets, geometry, index), focal_length)


def image(
    ideal: Float[Array, "obs 2"],
    offsets: Offsets,
    geometry: Geometry,
    index: Index,
    displacement: Float[Array, "#obs 2"] | float = 0.0,
) -> Prediction:
    """Predict measurements from undistorted positions.

    Parameters
    ----------
    ideal : um
    displacement : um, added to the distorted position. The derivative with respect to it,
        times `basis`, is the derivative with respect to the distortion coefficients.
    """
    scaled = ideal / geometry.distortion_scale
    values = basis(scaled[:, 0], scaled[:, 1], geometry.order)
    focal = ideal + values @ _pair(offsets, geometry, "distortion") + displacement
    n = index.detector
    pixel = to_pixel(
        focal,
        _pair(offsets, geometry, "detector")[n],
        RAD_PER_ARCSEC * geometry.value(offsets, "detector_rotation")[n],
        _pair(offsets, geometry, "pitch")[n],
    )
    return Prediction(ideal, focal, pixel, values)


def _pair(offsets: Offsets, geometry: Geometry, name: str) -> Float[Array, "_ 2"]:
    """Return the values of a pair of groups, one for each direction."""
    return jnp.stack([geometry.value(offsets, f"{name}_{axis}") for axis in "xy"], axis=-1)


def _apparent(offsets: Offsets, geometry: Geometry, index: Index) -> Float[Array, "obs 3"]:
    """Return apparent source directions along the axes of each exposure."""
    east, north = RAD_PER_MAS * offsets["sources"].T
    source = displace(geometry.source_frame, east, north)[index.source]
    centre = displace(
        geometry.pointing_frame,
        RAD_PER_ARCSEC * offsets["pointing_ra"],
        RAD_PER_ARCSEC * offsets["pointing_dec"],
    )
    axes = focal_axes(centre, RAD_PER_ARCSEC * geometry.value(offsets, "position_angle"))
    along_axes = jnp.sum(axes * geometry.velocity[:, None, :], axis=-1)
    m = index.exposure
    return aberrate(
        jnp.einsum("oij,oj->oi", axes[m], source),
        along_axes[m],
        jnp.sum(source * geometry.velocity[m], axis=-1),
        lorentz_factor(geometry.velocity)[m],
        geometry.sun_distance[m],
    )
