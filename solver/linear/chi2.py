"""The data's chi2 and its gradient, without the Hessian: one reverse pass of the model."""

from collections import deque
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

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
from solver.problem.parameter_vector import LOCAL_GROUPS, PER_COEFFICIENT
from solver.problem.problem import Problem


class Gradient(NamedTuple):
    """chi2 of the data, and minus the gradient of half of it by calibration and sources."""

    chi2: float
    by_theta: Float[np.ndarray, " calib"]
    by_source: Float[np.ndarray, "src 2"]


_TOUCHED = tuple(g.name for g in LOCAL_GROUPS if g.name not in DIRECTING)
_COEFFICIENTS = tuple(g.name for g in PER_COEFFICIENT)
# So many chunks are on their way at once: one by itself does not keep all cores busy, and all
# of a large orbit would need memory at once.
_IN_FLIGHT = 4


def gradient(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> Gradient:
    """Return chi2 of the data and its gradient at one point."""
    offsets, geometry = jax.device_put((problem.offsets(theta, sources), problem.geometry))
    seen = _directions(offsets, geometry)
    n_chunks, parts, total = len(problem.measurements.tiles.measured), deque(), None
    for i in range(n_chunks + _IN_FLIGHT):
        if i < n_chunks:
            parts.append(_of_chunk(seen, offsets, geometry, *problem.measurements.tiles.chunk(i)))
        if i >= _IN_FLIGHT and parts:
            part = jax.tree.map(np.asarray, parts.popleft())
            total = part if total is None else jax.tree.map(np.add, total, part)
    half, by_group = jax.tree.map(np.asarray, _to_offsets(total, offsets, geometry))
    by_theta, by_source = problem.gathered(by_group)
    return Gradient(2.0 * float(half), -by_theta, -by_source)


def half_chi2(
    seen: Directions,
    offsets: Offsets,
    displacement: Pair,
    geometry: Geometry,
    index: Index,
    measured: Float[AnyArray, "2 ..."],
    weight: Float[AnyArray, "2 ..."],
) -> tuple[Float[Array, ""], list[Float[Array, "..."]]]:
    """Return half of the data's chi2: minus the logarithm of the likelihood, but a constant.

    Parameters
    ----------
    seen : those of `offsets`
    displacement : um, added to the distorted positions
    measured : pixels
    weight : 1/sigma, pixel^-1

    Returns
    -------
    It, and the basis of the distortion: the derivative by `displacement` times the basis is that
    by the coefficients
    """
    ideal = ideal_position(seen, offsets, geometry, index)
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
    """Return `half_chi2` of all chunks, for JAX to differentiate once by the offsets.

    Value and gradient are made together, one chunk after the other, so that neither needs
    more memory than one chunk does.
    """
    return _with_gradient(offsets, geometry, index, measured, weight)[0]


def _with_gradient(
    offsets: Offsets, geometry: Geometry, *chunks: AnyArray
) -> tuple[Float[Array, ""], Offsets]:
    seen = directions(offsets, geometry)

    def add(total: _Part, chunk: tuple) -> tuple[_Part, None]:
        part = _of_chunk(seen, offsets, geometry, *chunk)
        return jax.tree.map(jnp.add, total, part), None

    others = {name: offsets[name] for name in (*_TOUCHED, *_COEFFICIENTS)}
    start = jax.tree.map(jnp.zeros_like, (jnp.zeros(()), seen, others))
    return _to_offsets(jax.lax.scan(add, start, chunks)[0], offsets, geometry)


def _scaled_gradient(gradient: Offsets, scale: Float[Array, ""]) -> tuple:
    return jax.tree.map(lambda values: scale * values, gradient), None, None, None, None


half_chi2_of_chunks.defvjp(_with_gradient, _scaled_gradient)


# Value and derivatives of `half_chi2`: by the directions, and by the offsets that are not in them.
_Part = tuple[Float[Array, ""], Directions, Offsets]

_directions = jax.jit(directions)


@jax.jit
def _of_chunk(
    seen: Directions, offsets: Offsets, geometry: Geometry, index: Index, *values: AnyArray
) -> _Part:
    still = (jnp.zeros_like(values[0][0]),) * 2

    def of(seen: Directions, touched: Offsets, displacement: Pair) -> tuple[Array, list[Array]]:
        return half_chi2(seen, {**offsets, **touched}, displacement, geometry, index, *values)

    touched = {name: offsets[name] for name in _TOUCHED}
    (half, basis), (by_directions, by_touched, by_displacement) = jax.value_and_grad(
        of, argnums=(0, 1, 2), has_aux=True
    )(seen, touched, still)
    # Both directions at once, and each term where it is: one product with all terms would need
    # them copied side by side first, which takes longer than the products.
    pair = jnp.stack(by_displacement).reshape(2, -1)
    by_terms = [pair @ term.reshape(-1) for term in basis]
    by_coefficients = jnp.stack(by_terms, axis=1) if basis else jnp.zeros((2, 0))
    return (
        half,
        by_directions,
        {**by_touched, **dict(zip(_COEFFICIENTS, by_coefficients, strict=True))},
    )


@jax.jit
def _to_offsets(
    total: _Part, offsets: Offsets, geometry: Geometry
) -> tuple[Float[Array, ""], Offsets]:
    """Return the derivatives by all offsets."""
    half, by_directions, by_others = total
    _, back = jax.vjp(lambda moved: directions(moved, geometry), offsets)
    return half, {**back(by_directions)[0], **by_others}
