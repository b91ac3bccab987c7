"""The data's chi2 and its gradient, without the Hessian, in one reverse pass of the model."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from solver.linear.chunks_in_turn import chunks_in_turn
from solver.model.forward import (
    DIRECTING,
    AnyArray,
    Directions,
    Geometry,
    Index,
    Offsets,
    Pair,
    directions,
    ideal_position,
    image,
)
from solver.problem.parameter_vector import local_groups, walk_groups
from solver.problem.problem import Problem


class Gradient(NamedTuple):
    """chi2 of the data, and minus the gradient of chi2 / 2 by calibration and by sources."""

    chi2: float
    by_theta: Float[np.ndarray, " calib"]
    by_source: Float[np.ndarray, "src 2"]


# Maximum number of chunks computed at once: a single one does not keep all cores busy, and all
# chunks of a large orbit would need too much memory.
_MAX_PENDING = 4


def gradient(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> Gradient:
    """Return chi2 of the data and its gradient at one point."""
    offsets, geometry = jax.device_put((problem.offsets(theta, sources), problem.geometry))
    sky = _directions(offsets, geometry)
    tiles, total = problem.measurements.tiles, None

    def launch(i: int) -> _ValueAndGradient:
        return _value_and_gradient(sky, offsets, geometry, *tiles.chunk(i))

    for launched in chunks_in_turn(launch, len(tiles.measured), ahead=_MAX_PENDING):
        of_chunk = jax.tree.map(np.asarray, launched)
        total = of_chunk if total is None else jax.tree.map(np.add, total, of_chunk)
    half, by_group = jax.tree.map(np.asarray, _with_offset_gradient(total, offsets, geometry))
    by_theta, by_source = problem.gathered(by_group)
    return Gradient(2.0 * float(half), -by_theta, -by_source)


def half_chi2(
    sky: Directions,
    offsets: Offsets,
    displacement: Pair,
    geometry: Geometry,
    index: Index,
    measured: Float[AnyArray, "2 ..."],
    weight: Float[AnyArray, "2 ..."],
) -> tuple[Float[Array, ""], list[Float[Array, "..."]]]:
    """Return half of the data's chi2: minus the log-likelihood, up to a constant.

    Parameters
    ----------
    sky : directions at `offsets`
    displacement : um, added to the distorted positions
    measured : pixels
    weight : 1/sigma, pixel^-1

    Returns
    -------
    Half of chi2, and the distortion basis, which times the derivative by `displacement` gives
    the derivative by the coefficients
    """
    ideal = ideal_position(sky, offsets, geometry, index)
    prediction = image(ideal, offsets, geometry, index, displacement)
    x, y = prediction.pixel
    whitened = (measured[0] - x) * weight[0], (measured[1] - y) * weight[1]
    return 0.5 * (jnp.sum(whitened[0] ** 2) + jnp.sum(whitened[1] ** 2)), prediction.basis


@jax.custom_vjp
def half_chi2_of_chunks(
    offsets: Offsets,
    geometry: Geometry,
    index: Index,
    measured: Float[AnyArray, "chunk 2 tile slot"],
    weight: Float[AnyArray, "chunk 2 tile slot"],
) -> Float[Array, ""]:
    """Return `half_chi2` of all chunks, differentiable once by JAX with respect to the offsets.

    Value and gradient are computed together, chunk by chunk, so that they need no more memory
    than one chunk.
    """
    return _with_gradient(offsets, geometry, index, measured, weight)[0]


def _with_gradient(
    offsets: Offsets, geometry: Geometry, *chunks: AnyArray
) -> tuple[Float[Array, ""], Offsets]:
    sky = directions(offsets, geometry)

    def add(total: _ValueAndGradient, chunk: tuple) -> tuple[_ValueAndGradient, None]:
        of_chunk = _value_and_gradient(sky, offsets, geometry, *chunk)
        return jax.tree.map(jnp.add, total, of_chunk), None

    undirecting = _non_directing(offsets) + [n for d in "xy" for n in geometry.term_groups(d)]
    other_offsets = {name: offsets[name] for name in undirecting}
    zero = jax.tree.map(jnp.zeros_like, (jnp.zeros(()), sky, other_offsets))
    return _with_offset_gradient(jax.lax.scan(add, zero, chunks)[0], offsets, geometry)


def _scaled_gradient(gradient: Offsets, scale: Float[Array, ""]) -> tuple:
    return jax.tree.map(lambda values: scale * values, gradient), None, None, None, None


half_chi2_of_chunks.defvjp(_with_gradient, _scaled_gradient)


# Value of `half_chi2`, its derivatives by the directions, and those by the offsets that the
# directions do not depend on.
_ValueAndGradient = tuple[Float[Array, ""], Directions, Offsets]

_directions = jax.jit(directions)


@jax.jit
def _value_and_gradient(
    sky: Directions, offsets: Offsets, geometry: Geometry, index: Index, *values: AnyArray
) -> _ValueAndGradient:
    no_displacement = (jnp.zeros_like(values[0][0]),) * 2

    def half_chi2_at(
        sky: Directions, moved: Offsets, displacement: Pair
    ) -> tuple[Array, list[Array]]:
        return half_chi2(sky, {**offsets, **moved}, displacement, geometry, index, *values)

    moved = {name: offsets[name] for name in _non_directing(offsets)}
    (half, basis), (by_directions, by_touched, by_displacement) = jax.value_and_grad(
        half_chi2_at, argnums=(0, 1, 2), has_aux=True
    )(sky, moved, no_displacement)
    # One product per term, for both directions: a single product with all terms would need them
    # copied into one array first, which takes longer than the products.
    pair = jnp.stack(by_displacement).reshape(2, -1)
    by_terms = [pair @ term.reshape(-1) for term in basis]
    by_coefficients = jnp.stack(by_terms, axis=1) if basis else jnp.zeros((2, 0))
    return half, by_directions, {**by_touched, **_by_group(by_coefficients, offsets, geometry)}


def _non_directing(offsets: Offsets) -> list[str]:
    """Return the groups of exposures and detectors that the directions do not depend on."""
    groups = (*local_groups(offsets), *walk_groups(offsets))
    return [group.name for group in groups if group.name not in DIRECTING]


def _by_group(
    by_terms: Float[Array, "2 term"], offsets: Offsets, geometry: Geometry
) -> dict[str, Float[Array, " _"]]:
    """Return the derivatives by the terms of both directions, by group."""
    found = {}
    for by_term, direction in zip(by_terms, "xy", strict=True):
        first = 0
        for name in geometry.term_groups(direction):
            found[name] = by_term[first : first + len(offsets[name])]
            first += len(offsets[name])
    return found


@jax.jit
def _with_offset_gradient(
    total: _ValueAndGradient, offsets: Offsets, geometry: Geometry
) -> tuple[Float[Array, ""], Offsets]:
    """Return the value and the derivatives by all offsets."""
    half, by_directions, by_other_offsets = total
    _, pull_back = jax.vjp(lambda moved: directions(moved, geometry), offsets)
    return half, {**pull_back(by_directions)[0], **by_other_offsets}
