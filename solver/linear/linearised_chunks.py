"""The measurements of a problem, linearised a chunk of tiles at a time to bound the memory."""

from collections.abc import Iterator

import jax
import numpy as np
from jaxtyping import Float

from solver.linear.linearise import Linearised, linearise, turning
from solver.problem.problem import Problem
from solver.runtime.interruption import give_way


def linearised_chunks(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> Iterator[Linearised]:
    """Linearise the measurements a chunk of tiles at a time.

    JAX computes the next chunk while the caller works on this one.
    """
    launched = _launched(problem, theta, sources)
    current = next(launched)
    for ahead in launched:
        give_way()
        yield jax.tree.map(np.asarray, current)
        current = ahead
    give_way()
    yield jax.tree.map(np.asarray, current)


def _launched(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> Iterator[Linearised]:
    """Yield each chunk while JAX still computes it."""
    # Transferred once, not with every chunk.
    offsets, geometry = jax.device_put((problem.offsets(theta, sources), problem.geometry))
    turn, n_padded = turning(offsets, geometry), problem.geometry.sizes["coef"]
    for i in range(len(problem.measurements.tiles.measured)):
        chunk = linearise(turn, offsets, geometry, *problem.measurements.tiles.chunk(i))
        yield chunk.with_terms(problem.layout.n_coef, n_padded)
