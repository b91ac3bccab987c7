"""Sums of products within each tile, before they are assembled into normal equations."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.linear.derivative_products import TiledDerivatives, in_tiles, one_by_one
from solver.linear.linearise import Linearised


@dataclass(frozen=True)
class TileSums:
    """Sums over the measurements of each tile, and values of each slot.

    Attributes
    ----------
    local : products between the derivatives by the local groups and, last, the residual
    mixed : products of these with the derivatives by the distortion coefficients
    basis : distortion terms of each slot
    shared : products of the derivatives by displacement and by source, of each slot
    walk : products of the derivatives by the first, walking coefficients with those by all
    """

    local: Float[np.ndarray, "chunk tile local local"]
    mixed: Float[np.ndarray, "chunk tile local two_coef"]
    basis: Float[np.ndarray, "chunk tile slot coef"]
    shared: Float[np.ndarray, "2 2 chunk tile slot"]
    walk: Float[np.ndarray, "chunk tile 2 walk 2 coef"]

    @classmethod
    def empty(cls, shape: tuple[int, ...], n_local: int, n_coef: int, n_walk: int) -> "TileSums":
        """Return uninitialised arrays for a shape (chunk, tile, slot)."""
        tiles, rows = shape[:2], n_local + 1
        return cls(
            np.empty((*tiles, rows, rows)),
            np.empty((*tiles, rows, 2 * n_coef)),
            np.empty((*shape, n_coef)),
            np.empty((2, 2, *shape)),
            np.empty((*tiles, 2, n_walk, 2, n_coef)),
        )

    def keep_slots(self, chunk: Linearised, rows: TiledDerivatives, i: int) -> None:
        """Fill in `basis` and `shared` of chunk `i`."""
        for term, values in enumerate(chunk.prediction.basis):
            self.basis[i, :, :, term] = values
        self.shared[:, :, i] = one_by_one(rows.displacement, rows.source)

    def sum_local(self, rows: TiledDerivatives, i: int) -> None:
        """Fill in `local` of chunk `i`."""
        flat = rows.local.reshape(*rows.local.shape[:2], -1)
        np.matmul(flat, flat.swapaxes(1, 2), out=self.local[i])

    def sum_mixed(self, rows: TiledDerivatives, i: int) -> None:
        """Fill in `mixed` of chunk `i`, after `keep_slots`."""
        mixed = in_tiles(rows.local, rows.displacement) @ self.basis[i]
        self.mixed[i] = mixed.reshape(self.mixed[i].shape)

    def sum_walk(self, rows: TiledDerivatives, i: int) -> None:
        """Fill in `walk` of chunk `i`, after `keep_slots`."""
        walk, basis = self.walk[i], self.basis[i]
        walking = basis[..., : walk.shape[2]]
        weight = one_by_one(rows.displacement, rows.displacement)
        for j, k in ((0, 0), (0, 1), (1, 1)):
            weighted = weight[j, k, :, :, None] * walking
            walk[:, j, :, k] = walk[:, k, :, j] = weighted.swapaxes(1, 2) @ basis
