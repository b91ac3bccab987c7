"""Products of the derivatives of a chunk, summed over the two coordinates of each measurement.

The derivatives of one tile are contiguous, so that all its products are computed while they are
in the caches. XLA passes over the whole chunk for each of fifty products, which takes nearly
twice as long.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from solver.linear.linearise import Linearised
from solver.model.forward import Pair


class TiledDerivatives(NamedTuple):
    """The fields of `Linearised` by tile; the last row of `local` is the residual."""

    local: Float[np.ndarray, "tile local 2 slot"]
    source: Float[np.ndarray, "tile 2 2 slot"]
    displacement: Float[np.ndarray, "tile 2 2 slot"]


def tiled_derivatives(chunk: Linearised) -> TiledDerivatives:
    """Return the rows of a chunk."""
    with_residual = [*chunk.local, chunk.residual]
    return TiledDerivatives(*map(side_by_side, (with_residual, chunk.source, chunk.displacement)))


def side_by_side(pairs: list[Pair]) -> Float[np.ndarray, "tile row 2 slot"]:
    """Return derivatives of x and y, a row each pair, as one array, contiguous for each tile."""
    flat = np.stack([values for pair in pairs for values in pair], axis=1)
    return flat.reshape(len(flat), len(pairs), 2, -1)


def one_by_one(
    first: Float[np.ndarray, "tile i 2 slot"], second: Float[np.ndarray, "tile j 2 slot"]
) -> Float[np.ndarray, "i j tile slot"]:
    """Return the sums over x and y of the products of all pairs of rows, tiles on an inner axis."""
    return np.einsum("tics,tjcs->ijts", first, second)


def in_tiles(
    first: Float[np.ndarray, "tile i 2 slot"], second: Float[np.ndarray, "tile j 2 slot"]
) -> Float[np.ndarray, "tile i_j slot"]:
    """Return the same as `one_by_one`, contiguous for each tile."""
    products = np.einsum("tics,tjcs->tijs", first, second)
    return products.reshape(len(first), -1, products.shape[-1])
