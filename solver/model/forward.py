"""The observation model: pixel positions predicted from parameters and geometry.

Paper, section "Observation model". Parameters are offsets from the origins in `Geometry`, in
the units of `solver.data.parameters`; a new parameter group needs an entry there and a term
here. The simulator, the engines and the diagnostics all use this model.

Quantities per measurement are stored one array per component, x separate from y, and an
index may broadcast over many measurements. All loops then run along contiguous memory, which
was measured to be ten times faster than arrays of small vectors.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from solver.data.distortion_terms import terms
from solver.data.parameters import OPTIONAL_GROUPS
from solver.model.aberration import Components, aberrate, inverse_lorentz_factor
from solver.model.causes import (
    ModelledCauses,
    anisotropic,
    moved_detector,
    shifted_on_detector,
    walked,
)
from solver.model.detector import to_pixel
from solver.model.distortion import basis
from solver.model.projection import displace, focal_axes, project
from solver.units import RAD_PER_ARCSEC, RAD_PER_MAS

# A NumPy array (from a table) or a JAX array (computed).
AnyArray = Any
Offsets = Mapping[str, AnyArray]
Pair = tuple[Float[AnyArray, "*obs"], Float[AnyArray, "*obs"]]
_OPTIONAL = frozenset(group.name for group in OPTIONAL_GROUPS)


class Geometry(eqx.Module):
    """Origins of the parameter offsets, and inputs of the model that are not parameters.

    Attributes
    ----------
    source_frame : direction, east and north at each source's origin
    pointing_frame : direction, east and north at each exposure's origin
    origin : group name -> value at offset zero, in the group's unit; without the sources and
        the pointing, whose origins are the frames
    velocity : velocity of the observer, in c; zero switches aberration off
    sun_distance : distance of the observer from the Sun, au
    distortion_scale : 1/s, um
    order : highest degree of the distortion
    causes : inputs of the optional parameter groups; None for a fit without any
    """

    source_frame: Float[AnyArray, "src 3 3"]
    pointing_frame: Float[AnyArray, "exp 3 3"]
    origin: dict[str, Float[AnyArray, " _"]]
    velocity: Float[AnyArray, "exp 3"]
    sun_distance: Float[AnyArray, " exp"]
    distortion_scale: Float[AnyArray, ""]
    order: int = eqx.field(static=True)
    causes: ModelledCauses | None = None

    @property
    def sizes(self) -> dict[str, int]:
        """The lengths of the axes that are padded."""
        return {
            "src": len(self.source_frame),
            "exp": len(self.pointing_frame),
            "coef": len(terms(self.order)),
            "walk": len(self.origin.get("drift_walk_x", ())),
        }

    def value(self, offsets: Offsets, name: str) -> Float[Array, " _"]:
        """Return the value (origin plus offset) of a group, in its unit."""
        return self.origin[name] + offsets[name]

    def optional(self, offsets: Offsets) -> dict[str, Float[Array, " _"]]:
        """Return the values of the optional groups that the fit includes."""
        return {name: self.value(offsets, name) for name in offsets if name in _OPTIONAL}

    def term_groups(self, direction: str) -> list[str]:
        """Return the groups of the coefficients of a direction, "x" or "y", in order."""
        of_causes = self.causes.names(direction) if self.causes is not None else []
        return [f"distortion_{direction}", *of_causes]


class Index(NamedTuple):
    """Indices of the source, exposure and detector of each measurement.

    The arrays have any common shape; `exposure` and `detector` may have length one along an
    axis whose measurements all share them.
    """

    source: Int[AnyArray, "*obs"]
    exposure: Int[AnyArray, "*#obs"]
    detector: Int[AnyArray, "*#obs"]


class Prediction(NamedTuple):
    """Predicted position of each measurement, as separate arrays of x and y.

    `ideal` and `focal` are on the undistorted and distorted focal plane, um; `pixel` is
    from the detector's centre; `basis` holds the value of each distortion term.
    """

    ideal: Pair
    focal: Pair
    pixel: Pair
    basis: list[Float[AnyArray, "*obs"]]


class Directions(NamedTuple):
    """Unit vectors to the sources, and the axes of each exposure's focal plane on the sky.

    They do not depend on the measurement and are computed once.
    """

    source: tuple[Float[AnyArray, " src"], Float[AnyArray, " src"], Float[AnyArray, " src"]]
    axes: Float[AnyArray, "exp 3 3"]


# The groups of the exposures that `directions` uses.
DIRECTING = ("pointing_ra", "pointing_dec", "position_angle")


def predict(offsets: Offsets, geometry: Geometry, index: Index) -> Prediction:
    """Predict the measurements of `index`.

    Parameters
    ----------
    offsets : group name -> offsets in the group's unit; "sources" has shape (src, 2), the
        others have one value per element of their axis
    """
    ideal = ideal_position(directions(offsets, geometry), offsets, geometry, index)
    return image(ideal, offsets, geometry, index)


def directions(offsets: Offsets, geometry: Geometry) -> Directions:
    """Return the directions of the sources and of the focal-plane axes of the exposures."""
    east, north = RAD_PER_MAS * offsets["sources"].T
    x, y, z = displace(geometry.source_frame, east, north).T
    centre = displace(
        geometry.pointing_frame,
        RAD_PER_ARCSEC * offsets["pointing_ra"],
        RAD_PER_ARCSEC * offsets["pointing_dec"],
    )
    position_angle = RAD_PER_ARCSEC * geometry.value(offsets, "position_angle")
    return Directions((x, y, z), focal_axes(centre, position_angle))


def ideal_position(seen: Directions, offsets: Offsets, geometry: Geometry, index: Index) -> Pair:
    """Return positions on the undistorted focal plane, um."""
    focal_length = geometry.value(offsets, "focal_length")[index.exposure]
    ideal = project(_apparent(seen, geometry, index), focal_length)
    return anisotropic(ideal, geometry.optional(offsets), index.exposure)


def image(
    ideal: Pair,
    offsets: Offsets,
    geometry: Geometry,
    index: Index,
    displacement: tuple[AnyArray, AnyArray] = (0.0, 0.0),
) -> Prediction:
    """Predict measurements from undistorted positions.

    Parameters
    ----------
    ideal : positions on the undistorted focal plane, um
    displacement : um, added to the distorted position. The derivative with respect to it,
        times `basis`, is the derivative with respect to the distortion coefficients.
    """
    x, y = ideal
    values = basis(x / geometry.distortion_scale, y / geometry.distortion_scale, geometry.order)
    if geometry.causes is not None:
        values += geometry.causes.terms(ideal, index.exposure, index.detector)
    optional = geometry.optional(offsets)
    coefficients = [
        walked(
            _coefficients(offsets, geometry, direction),
            optional,
            direction,
            index.exposure,
            len(geometry.pointing_frame),
        )
        for direction in "xy"
    ]
    focal_x, focal_y = (
        ideal[axis] + (sum(c * b for c, b in zip(terms, values, strict=True)) + shift)
        for axis, (terms, shift) in enumerate(zip(coefficients, displacement, strict=True))
    )
    pixel = on_detector((focal_x, focal_y), offsets, geometry, index)
    return Prediction(ideal, (focal_x, focal_y), pixel, values)


def on_detector(focal: Pair, offsets: Offsets, geometry: Geometry, index: Index) -> Pair:
    """Return pixels from the centres of the detectors.

    Parameters
    ----------
    focal : positions on the distorted focal plane, um
    """
    n, optional = index.detector, geometry.optional(offsets)
    centre_x, centre_y = _pair(offsets, geometry, "detector")
    pitch_x, pitch_y = _pair(offsets, geometry, "pitch")
    rotation = RAD_PER_ARCSEC * geometry.value(offsets, "detector_rotation")
    centre, angle = moved_detector(
        (centre_x[n], centre_y[n]), rotation[n], optional, geometry.causes, index.exposure, n
    )
    pixel = to_pixel(focal, centre, angle, (pitch_x[n], pitch_y[n]))
    return shifted_on_detector(pixel, optional, geometry.causes, index.source, n)


def _coefficients(offsets: Offsets, geometry: Geometry, direction: str) -> list[Float[Array, ""]]:
    """Return the coefficients of all terms of a direction, in the order of `Prediction.basis`."""
    return [c for name in geometry.term_groups(direction) for c in geometry.value(offsets, name)]


def _pair(
    offsets: Offsets, geometry: Geometry, name: str
) -> tuple[Float[Array, " _"], Float[Array, " _"]]:
    """Return the values of the x and y groups of a parameter."""
    return geometry.value(offsets, f"{name}_x"), geometry.value(offsets, f"{name}_y")


def _apparent(seen: Directions, geometry: Geometry, index: Index) -> Components:
    """Return apparent source directions along the axes of each exposure."""
    m = index.exposure
    x, y, z = (jnp.asarray(component)[index.source] for component in seen.source)
    source = x, y, z
    x, y, z = (_dot(_take(seen.axes[:, axis], m), source) for axis in range(3))
    return aberrate(
        (x, y, z),
        _take(jnp.sum(seen.axes * geometry.velocity[:, None, :], axis=-1), m),
        _dot(_take(geometry.velocity, m), source),
        inverse_lorentz_factor(geometry.velocity)[m],
        geometry.sun_distance[m],
    )


def _take(vectors: Float[AnyArray, "_ 3"], index: Int[AnyArray, "*#obs"]) -> Components:
    """Return the components of the vectors at an index."""
    x, y, z = (jnp.asarray(vectors[:, axis])[index] for axis in range(3))
    return x, y, z


def _dot(first: Components, second: Components) -> Float[Array, "*#obs"]:
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]
