"""Whitened residuals and exact Jacobians of the observation model.

Each measurement touches one source, one exposure and one detector, so the derivative by
a whole group is one forward-mode pass with every element of the group moved at once.
The distortion coefficients are shared by all measurements, but act only through the
displacement they add: its derivative and the basis stand for theirs.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from solver.forward import Geometry, Index, Offsets, Prediction, predict
from solver.layout import PER_DETECTOR, PER_EXPOSURE
from solver.parameters import SOURCES


class Linearised(NamedTuple):
    """One chunk of measurements, linearised; all but `prediction` divided by sigma.

    `residual` is measured minus predicted. The others are derivatives of the prediction:
    by the source's two offsets (mas^-1), by the groups on the exposure and on the detector
    (per group unit), and by a displacement on the focal plane (um^-1).
    """

    residual: Float[Array, "obs 2"]
    source: Float[Array, "obs 2 2"]
    exposure: Float[Array, "obs 2 per_exp"]
    detector: Float[Array, "obs 2 per_det"]
    displacement: Float[Array, "obs 2 2"]
    prediction: Prediction


@jax.jit
def linearise(
    offsets: Offsets,
    geometry: Geometry,
    index: Index,
    measured: Float[Array, "obs 2"],
    weight: Float[Array, "obs 2"],
) -> Linearised:
    """Linearise the model at `offsets`.

    Parameters
    ----------
    measured : pixels
    weight : 1/sigma, pixel^-1; zero removes a coordinate
    """
    prediction = predict(offsets, geometry, index)
    by_group = partial(_derivative_by, offsets, geometry, index)
    sources = offsets[SOURCES.name]
    east, north = (
        jnp.zeros_like(sources).at[:, 0].set(1.0),
        jnp.zeros_like(sources).at[:, 1].set(1.0),
    )

    def whitened(columns: list[Float[Array, "obs 2"]]) -> Float[Array, "obs 2 _"]:
        return jnp.stack(columns, axis=-1) * weight[:, :, None]

    return Linearised(
        residual=(measured - prediction.pixel) * weight,
        source=whitened([by_group(SOURCES.name, east), by_group(SOURCES.name, north)]),
        exposure=whitened([by_group(g.name, jnp.ones_like(offsets[g.name])) for g in PER_EXPOSURE]),
        detector=whitened([by_group(g.name, jnp.ones_like(offsets[g.name])) for g in PER_DETECTOR]),
        displacement=whitened(
            [_derivative_by_displacement(offsets, geometry, index, axis) for axis in range(2)]
        ),
        prediction=prediction,
    )


def _derivative_by(
    offsets: Offsets, geometry: Geometry, index: Index, name: str, tangent: Float[Array, "..."]
) -> Float[Array, "obs 2"]:
    def pixel(values: Float[Array, "..."]) -> Float[Array, "obs 2"]:
        return predict({**offsets, name: values}, geometry, index).pixel

    return jax.jvp(pixel, (offsets[name],), (tangent,))[1]


def _derivative_by_displacement(
    offsets: Offsets, geometry: Geometry, index: Index, axis: int
) -> Float[Array, "obs 2"]:
    def pixel(displacement: Float[Array, "1 2"]) -> Float[Array, "obs 2"]:
        return predict(offsets, geometry, index, displacement).pixel

    zero = jnp.zeros((1, 2))
    return jax.jvp(pixel, (zero,), (zero.at[0, axis].set(1.0),))[1]
