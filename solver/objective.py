"""The data's chi2 and its gradient, without the Hessian: one reverse pass of the model."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from solver.forward import AnyArray, Geometry, Index, Offsets, predict
from solver.problem import Problem


class Gradient(NamedTuple):
    """chi2 of the data, and minus the gradient of half of it by calibration and sources."""

    chi2: float
    by_theta: Float[np.ndarray, " calib"]
    by_source: Float[np.ndarray, "src 2"]


def gradient(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> Gradient:
    """Return chi2 of the data and its gradient at one point."""
    offsets = problem.offsets(theta, sources)
    # NumPy's zeros: each of JAX's is a compilation, and a bare 0.0 would be one more of the sum.
    total = jax.tree.map(np.zeros_like, (np.zeros(()), offsets))
    offsets, geometry = jax.device_put((offsets, problem.geometry))
    for i in range(len(problem.tiles.measured)):
        total = _add_chunk(total, offsets, geometry, *problem.tiles.chunk(i))
    half, by_group = jax.tree.map(np.asarray, total)
    by_theta, by_source = problem.gathered(by_group)
    return Gradient(2.0 * float(half), -by_theta, -by_source)


def half_chi2(
    offsets: Offsets,
    geometry: Geometry,
    index: Index,
    measured: Float[AnyArray, "2 ..."],
    weight: Float[AnyArray, "2 ..."],
) -> Float[Array, ""]:
    """Return half of the data's chi2: minus the logarithm of the likelihood, but a constant.

    Parameters
    ----------
    measured : pixels
    weight : 1/sigma, pixel^-1
    """
    x, y = predict(offsets, geometry, index).pixel
    whitened = (measured[0] - x) * weight[0], (measured[1] - y) * weight[1]
    return 0.5 * (jnp.sum(whitened[0] ** 2) + jnp.sum(whitened[1] ** 2))


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
    def add(total: tuple, chunk: tuple) -> tuple[tuple, None]:
        return _add_chunk(total, offsets, geometry, *chunk), None

    start = jax.tree.map(jnp.zeros_like, (jnp.zeros(()), offsets))
    return jax.lax.scan(add, start, chunks)[0]


def _scaled_gradient(gradient: Offsets, scale: Float[Array, ""]) -> tuple:
    return jax.tree.map(lambda values: scale * values, gradient), None, None, None, None


half_chi2_of_chunks.defvjp(_with_gradient, _scaled_gradient)


@jax.jit
def _add_chunk(
    total: tuple[Float[Array, ""], Offsets], offsets: Offsets, *chunk: AnyArray
) -> tuple[Float[Array, ""], Offsets]:
    return jax.tree.map(jnp.add, total, jax.value_and_grad(half_chi2)(offsets, *chunk))
