"""Whitened residuals and exact Jacobians of the observation model.

Each measurement touches one source, one exposure and one detector, so the derivative by
a whole group is one forward-mode pass with every element of the group moved at once.
The distortion coefficients are shared by all measurements, but act only through the
displacement they add: its derivative and the basis stand for theirs.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from solver.forward import AnyArray, Geometry, Index, Offsets, Prediction, ideal_position, image
from solver.layout import PER_DETECTOR, PER_EXPOSURE
from solver.parameters import SOURCES, Group


class Products(NamedTuple):
    """The derivatives by the source, transposed, times the other parts of `Linearised`.

    They are made here because they are many and tiny: two rows each.
    """

    residual: Float[AnyArray, "obs 2"]
    source: Float[AnyArray, "obs 2 2"]
    exposure: Float[AnyArray, "obs 2 per_exp"]
    detector: Float[AnyArray, "obs 2 per_det"]
    displacement: Float[AnyArray, "obs 2 2"]


class Linearised(NamedTuple):
    """One chunk of measurements, linearised; all but `prediction` divided by sigma.

    `residual` is measured minus predicted. The others are derivatives of the prediction:
    by the source's two offsets (mas^-1), by the groups on the exposure and on the detector
    (per group unit), and by a displacement on the focal plane (um^-1).
    """

    residual: Float[AnyArray, "obs 2"]
    source: Float[AnyArray, "obs 2 2"]
    exposure: Float[AnyArray, "obs 2 per_exp"]
    detector: Float[AnyArray, "obs 2 per_det"]
    displacement: Float[AnyArray, "obs 2 2"]
    prediction: Prediction
    products: Products


@jax.jit
def linearise(
    offsets: Offsets,
    geometry: Geometry,
    index: Index,
    measured: Float[AnyArray, "obs 2"],
    weight: Float[AnyArray, "obs 2"],
) -> Linearised:
    """Linearise the model at `offsets`.

    Parameters
    ----------
    measured : pixels
    weight : 1/sigma, pixel^-1; zero removes a coordinate
    """
    ideal = ideal_position(offsets, geometry, index)
    prediction = image(ideal, offsets, geometry, index)
    by_ideal = _derivative(lambda moved: image(moved, offsets, geometry, index).pixel, ideal)

    def by_group(name: str, tangent: Float[Array, "..."]) -> Float[Array, "obs 2"]:
        """Chain the derivative through the focal plane, where both stages are narrow."""

        def with_values(values: Float[Array, "..."]) -> Offsets:
            return {**offsets, name: values}

        on_plane, on_detector = (
            jax.jvp(stage, (offsets[name],), (tangent,))[1]
            for stage in (
                lambda values: ideal_position(with_values(values), geometry, index),
                lambda values: image(ideal, with_values(values), geometry, index).pixel,
            )
        )
        return jnp.einsum("oij,oj->oi", by_ideal, on_plane) + on_detector

    def by_groups(groups: tuple[Group, ...]) -> Float[Array, "obs 2 _"]:
        columns = [by_group(g.name, jnp.ones_like(offsets[g.name])) for g in groups]
        return jnp.stack(columns, axis=-1) * weight[:, :, None]

    east = jnp.zeros_like(offsets[SOURCES.name]).at[:, 0].set(1.0)
    by_source = [by_group(SOURCES.name, tangent) for tangent in (east, 1.0 - east)]
    by_displacement = _derivative(
        lambda moved: image(ideal, offsets, geometry, index, moved).pixel, jnp.zeros_like(ideal)
    )
    residual = (measured - prediction.pixel) * weight
    source = jnp.stack(by_source, axis=-1) * weight[:, :, None]
    exposure, detector = by_groups(PER_EXPOSURE), by_groups(PER_DETECTOR)
    displacement = by_displacement * weight[:, :, None]

    def times_source(right: Float[Array, "obs 2 k"]) -> Float[Array, "obs 2 k"]:
        return jnp.sum(source[:, :, :, None] * right[:, :, None, :], axis=1)

    products = Products(
        times_source(residual[:, :, None])[:, :, 0],
        *(times_source(part) for part in (source, exposure, detector, displacement)),
    )
    return Linearised(residual, source, exposure, detector, displacement, prediction, products)


def _derivative(
    of: Callable[[Float[Array, "obs 2"]], Float[Array, "obs 2"]], at: Float[Array, "obs 2"]
) -> Float[Array, "obs 2 2"]:
    """Return the derivative of each row of a function by its own row of the argument."""
    x = jnp.zeros_like(at).at[:, 0].set(1.0)
    return jnp.stack([jax.jvp(of, (at,), (unit,))[1] for unit in (x, 1.0 - x)], axis=-1)
