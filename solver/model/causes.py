"""Causes: effects beyond the paper's model that a fit may include, one function per place.

Each is an addition to `solver.model.forward` that is skipped, not multiplied by zero, where the
fit does not include it. A fit without causes is computed as if this module did not exist.
"""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from solver.model.distortion import basis
from solver.units import PIX_PER_MPIX, PPM, RAD_PER_ARCSEC

AnyArray = Any
# Optional group -> values, in the group's unit; only of those that the fit includes.
Values = Mapping[str, Float[AnyArray, " _"]]
Pair = tuple[Float[AnyArray, "*obs"], Float[AnyArray, "*obs"]]


class TermFamily(eqx.Module):
    """Distortion terms whose coefficients apply to some exposures and detectors.

    Each coefficient multiplies a term and a factor of the exposure and detector, such as the time.

    Attributes
    ----------
    name : of its groups, without "_x" and "_y"
    order : highest degree of the terms
    factor : one row per function; the terms of a function are adjacent
    centre, scale : origin and unit of the terms on each detector, um
    """

    name: str = eqx.field(static=True)
    order: int = eqx.field(static=True)
    factor: Float[AnyArray, "function exp det"]
    centre: Float[AnyArray, "det 2"]
    scale: Float[AnyArray, " det"]


class ModelledCauses(eqx.Module):
    """Inputs of the causes that are not parameters.

    Attributes
    ----------
    families : of distortion terms
    element : index of the detector in its span, among the elements of the axis `motion`
    moves : one where the detector may have moved, zero in the first span
    faintness : flux^(-1/2) of the sources, as from `solver.data.magnitudes`
    pixels : number of pixels of the detectors along their axes
    """

    families: tuple[TermFamily, ...]
    element: Int[AnyArray, "exp det"]
    moves: Float[AnyArray, "exp det"]
    faintness: Float[AnyArray, " src"]
    pixels: Float[AnyArray, "det 2"]

    def names(self, direction: str) -> list[str]:
        """Return the groups of the families' coefficients of a direction, "x" or "y"."""
        return [f"{family.name}_{direction}" for family in self.families]

    def terms(
        self, ideal: Pair, exposure: Int[AnyArray, "*#obs"], detector: Int[AnyArray, "*#obs"]
    ) -> list[Float[Array, "*obs"]]:
        """Return the values of the terms of all families, each times its factor."""
        values = []
        for family in self.families:
            x, y = (
                (ideal[axis] - jnp.asarray(family.centre)[detector, axis])
                / jnp.asarray(family.scale)[detector]
                for axis in (0, 1)
            )
            factors = jnp.asarray(family.factor)[:, exposure, detector]
            of_family = basis(x, y, family.order)
            values += [factor * value for factor in factors for value in of_family]
        return values


def anisotropic(ideal: Pair, values: Values, exposure: Int[AnyArray, "*#obs"]) -> Pair:
    """Return ideal positions under a focal length for each axis, whose mean is unchanged."""
    if "focal_anisotropy" not in values:
        return ideal
    half = 0.5 * PPM * values["focal_anisotropy"][exposure]
    return ideal[0] * (1.0 - half), ideal[1] * (1.0 + half)


def walked(
    coefficients: list[Float[Array, ""]],
    values: Values,
    direction: str,
    exposure: Int[AnyArray, "*#obs"],
    n_exp: int,
) -> list[Float[Array, "*#obs"]]:
    """Return the coefficients of the terms at each exposure, the first of which walk.

    Parameters
    ----------
    direction : "x" or "y"
    n_exp : number of exposures, padded
    """
    if f"drift_walk_{direction}" not in values:
        return coefficients
    walk = values[f"drift_walk_{direction}"].reshape(n_exp, -1)
    count = walk.shape[1]
    at_exposure = [c + walk[exposure, k] for k, c in enumerate(coefficients[:count])]
    return [*at_exposure, *coefficients[count:]]


def moved_detector(
    centre: Pair,
    rotation: Float[Array, "*#obs"],
    values: Values,
    causes: ModelledCauses | None,
    exposure: Int[AnyArray, "*#obs"],
    detector: Int[AnyArray, "*#obs"],
) -> tuple[Pair, Float[Array, "*#obs"]]:
    """Return centre, um, and rotation, rad, of the detectors in the span of each exposure."""
    if causes is None or "detector_turn" not in values:
        return centre, rotation
    element = jnp.asarray(causes.element)[exposure, detector]
    moves = jnp.asarray(causes.moves)[exposure, detector]
    x, y, turn = (
        moves * values[name][element]
        for name in ("detector_motion_x", "detector_motion_y", "detector_turn")
    )
    return (centre[0] + x, centre[1] + y), rotation + RAD_PER_ARCSEC * turn


def shifted_on_detector(
    pixel: Pair,
    values: Values,
    causes: ModelledCauses | None,
    source: Int[AnyArray, "*obs"],
    detector: Int[AnyArray, "*#obs"],
) -> Pair:
    """Return pixels under the skew of the detectors and the shifts by magnitude and phase."""
    if causes is None:
        return pixel
    shifts = [[], []]
    if "detector_skew" in values:
        skew = RAD_PER_ARCSEC * values["detector_skew"][detector]
        shifts[0].append(skew * pixel[1])
    faintness = jnp.asarray(causes.faintness)[source]
    for axis, direction in enumerate("xy"):
        if f"magnitude_shift_{direction}" in values:
            shift = PIX_PER_MPIX * values[f"magnitude_shift_{direction}"][detector]
            shifts[axis].append(faintness * shift)
        if f"charge_transfer_{direction}" in values:
            shift = PIX_PER_MPIX * values[f"charge_transfer_{direction}"][detector]
            # From the edge of the detector: what the charge of the star has crossed.
            crossed = pixel[axis] / jnp.asarray(causes.pixels)[detector, axis] + 0.5
            shifts[axis].append(faintness * shift * crossed)
    if "phase_sine_x" in values:
        for axis, direction in enumerate("xy"):
            sine, cosine = (
                PIX_PER_MPIX * values[f"{name}_{direction}"][detector]
                for name in ("phase_sine", "phase_cosine")
            )
            angle = 2.0 * jnp.pi * pixel[axis]
            shifts[axis].append(sine * jnp.sin(angle) + cosine * jnp.cos(angle))
    x, y = (sum(parts, start=place) for parts, place in zip(shifts, pixel, strict=True))
    return x, y
