"""Whitened residuals and exact Jacobians of the observation model.

Each measurement depends on one source, exposure and detector, so the derivative with respect to
a whole group is one forward-mode pass with every element of the group moved at once.
All measurements share the distortion coefficients, which act only through a displacement on the
focal plane. The derivative by this displacement and the values of the basis are kept, instead of
one derivative per coefficient.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from solver.data.parameters import SOURCES
from solver.model.forward import (
    DIRECTING,
    AnyArray,
    Directions,
    Geometry,
    Index,
    Offsets,
    Pair,
    Prediction,
    directions,
    ideal_position,
    image,
    on_detector,
)
from solver.problem.parameter_vector import local_groups

# Traced once, and not again for each of the twenty derivatives.
_ideal_position = jax.jit(ideal_position, inline=True)
_image = jax.jit(image, inline=True)
_on_detector = jax.jit(on_detector, inline=True)


class Linearised(NamedTuple):
    """A chunk of tiles, linearised; all but `prediction` divided by sigma, x and y separately.

    `residual` is measured minus predicted. The others are derivatives of the prediction:
    by the source's two offsets (mas^-1), by the groups of `local_groups` (per group unit),
    and by a displacement on the focal plane (um^-1).
    """

    residual: Pair
    source: list[Pair]
    local: list[Pair]
    displacement: list[Pair]
    prediction: Prediction

    def with_terms(self, n_coef: int, n_padded: int) -> "Linearised":
        """Return the same with `n_coef` of the distortion's terms, of which there are `n_padded`.

        The terms after those of the distortion are kept.
        """
        basis = self.prediction.basis
        kept = self.prediction._replace(basis=basis[:n_coef] + basis[n_padded:])
        return self._replace(prediction=kept)


class Imaged(NamedTuple):
    """The prediction of a chunk of tiles, and its derivatives by the ideal positions.

    `along` holds the derivatives of `prediction.pixel` by x and by y, pixel/um.
    """

    prediction: Prediction
    along: list[Pair]


class Turning(NamedTuple):
    """The directions and their derivatives, which all chunks share.

    Attributes
    ----------
    at : the directions at the offsets
    source : derivatives of `at.source` by a source's two offsets, mas^-1
    axes : group name -> derivative of `at.axes`, per group unit
    """

    at: Directions
    source: list[tuple[Float[AnyArray, " src"], ...]]
    axes: dict[str, Float[AnyArray, "exp 3 3"]]


@jax.jit
def turning(offsets: Offsets, geometry: Geometry) -> Turning:
    """Return the directions at `offsets`, and their derivatives."""

    def by_group(name: str, tangent: Float[Array, "..."]) -> Directions:
        def moved(values: Float[Array, "..."]) -> Directions:
            return directions({**offsets, name: values}, geometry)

        return jax.jvp(moved, (jnp.asarray(offsets[name]),), (tangent,))[1]

    east = jnp.zeros_like(offsets[SOURCES.name]).at[:, 0].set(1.0)
    return Turning(
        directions(offsets, geometry),
        [by_group(SOURCES.name, tangent).source for tangent in (east, 1.0 - east)],
        {name: by_group(name, jnp.ones_like(offsets[name])).axes for name in DIRECTING},
    )


def linearise(
    turn: Turning,
    offsets: Offsets,
    geometry: Geometry,
    index: Index,
    measured: Float[AnyArray, "2 tile slot"],
    weight: Float[AnyArray, "2 tile slot"],
) -> Linearised:
    """Linearise the model at `offsets`.

    Parameters
    ----------
    turn : as from `turning`, at the same offsets
    measured : pixels
    weight : 1/sigma, pixel^-1; zero removes a coordinate
    """
    # Compiled separately: within one program XLA would recompute these for each of the twenty
    # derivatives chained to them, which was measured to double its work.
    at = _imaged(turn, offsets, geometry, index)
    residual, source, local, displacement = _derivatives(
        turn, offsets, geometry, index, measured, weight, at
    )
    return Linearised(residual, source, local, displacement, at.prediction)


@jax.jit
def _imaged(turn: Turning, offsets: Offsets, geometry: Geometry, index: Index) -> Imaged:
    ideal = _ideal_position(turn.at, offsets, geometry, index)
    along = _by_axes(lambda moved: _image(moved, offsets, geometry, index).pixel, ideal)
    return Imaged(image(ideal, offsets, geometry, index), along)


@jax.jit
def _derivatives(
    turn: Turning,
    offsets: Offsets,
    geometry: Geometry,
    index: Index,
    measured: Float[AnyArray, "2 tile slot"],
    weight: Float[AnyArray, "2 tile slot"],
    imaged: Imaged,
) -> tuple[Pair, list[Pair], list[Pair], list[Pair]]:
    """Return the fields of `Linearised` except the prediction, which would be copied here."""
    prediction, (along_x, along_y) = imaged
    focal = prediction.focal

    def through_plane(shift: Pair) -> Pair:
        """Chain a derivative through the ideal plane, where both stages have two components."""
        return tuple(along_x[i] * shift[0] + along_y[i] * shift[1] for i in (0, 1))

    def by_directions(field: str, tangent: AnyArray) -> Pair:
        """Return the pixel derivative along a tangent of one field of the directions."""

        def moved(values: AnyArray) -> Pair:
            return _ideal_position(turn.at._replace(**{field: values}), offsets, geometry, index)

        return through_plane(jax.jvp(moved, (getattr(turn.at, field),), (tangent,))[1])

    def by_group(name: str) -> Pair:
        if name in turn.axes:
            return whiten(*by_directions("axes", turn.axes[name]))
        values, one = jnp.asarray(offsets[name]), jnp.ones_like(offsets[name])
        # None acts on the distortion between the two, which is most of the model.
        by_plane, by_detector = (
            jax.jvp(stage, (values,), (one,))[1]
            for stage in (
                lambda moved: _ideal_position(turn.at, {**offsets, name: moved}, geometry, index),
                lambda moved: _on_detector(focal, {**offsets, name: moved}, geometry, index),
            )
        )
        return whiten(*jax.tree.map(jnp.add, through_plane(by_plane), by_detector))

    def whiten(x: Float[Array, "*#obs"], y: Float[Array, "*#obs"]) -> Pair:
        return weight[0] * x, weight[1] * y

    def displaced(moved: Pair) -> Pair:
        return _on_detector(moved, offsets, geometry, index)

    x, y = prediction.pixel
    residual = whiten(measured[0] - x, measured[1] - y)
    source = [whiten(*by_directions("source", tangent)) for tangent in turn.source]
    local = [by_group(g.name) for g in local_groups(offsets)]
    displacement = [whiten(*by) for by in _by_axes(displaced, focal)]
    return residual, source, local, displacement


def _by_axes(function: Callable[[Pair], Pair], at: Pair) -> list[Pair]:
    """Return the derivatives of a function by the two components of its argument."""
    one, zero = jnp.ones_like(at[0]), jnp.zeros_like(at[0])
    return [jax.jvp(function, (at,), (unit,))[1] for unit in ((one, zero), (zero, one))]
