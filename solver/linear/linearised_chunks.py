"""The measurements of a problem, linearised a chunk of tiles at a time to bound the memory."""

from collections.abc import Iterator

import jax
import numpy as np
from jaxtyping import Float

from solver.linear.chunks_in_turn import chunks_in_turn
from solver.linear.linearise import Linearised, linearise, turning
from solver.problem.problem import Problem


def linearised_chunks(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> Iterator[Linearised]:
    """Linearise the measurements a chunk of tiles at a time.

    JAX computes the next chunk while the caller works on this one.
    """
    # Transferred once, not with every chunk.
    offsets, geometry = jax.device_put((problem.offsets(theta, sources), problem.geometry))
    turn, n_padded = turning(offsets, geometry), problem.geometry.sizes["coef"]
    tiles = problem.measurements.tiles

    def launch(i: int) -> Linearised:
        chunk = linearise(turn, offsets, geometry, *tiles.chunk(i))
        return chunk.with_terms(problem.layout.n_coef, n_padded)

    for chunk in chunks_in_turn(launch, len(tiles.measured), ahead=1):
        yield jax.tree.map(np.asarray, chunk)
