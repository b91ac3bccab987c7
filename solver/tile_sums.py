"""Sums of products within each tile, before it is known where they belong."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.forward import AnyArray
from solver.layout import LOCAL_GROUPS
from solver.linearise import Linearised, Products

N_LOCAL = len(LOCAL_GROUPS)


@dataclass(frozen=True)
class TileSums:
    """What the measurements of each tile add up to, and what is kept of each slot.

    Attributes
    ----------
    local : products of the derivatives by `LOCAL_GROUPS` and, last, the residual
    mixed : those with the distortion's two directions, times the terms
    basis : of each slot, the distortion terms
    shared : of each slot, the products of a displacement with the source
    """

    local: Float[np.ndarray, "chunk tile local local"]
    mixed: Float[np.ndarray, "chunk tile local two_coef"]
    basis: Float[np.ndarray, "chunk tile slot coef"]
    shared: Float[np.ndarray, "2 2 chunk tile slot"]

    @classmethod
    def empty(cls, shape: tuple[int, ...], n_coef: int) -> "TileSums":
        """Return room for the sums of chunks, tiles and slots of some shape."""
        tiles, rows = shape[:2], N_LOCAL + 1
        return cls(
            np.empty((*tiles, rows, rows)),
            np.empty((*tiles, rows, 2 * n_coef)),
            np.empty((*shape, n_coef)),
            np.empty((2, 2, *shape)),
        )

    def keep_slots(self, chunk: Linearised, products: Products, i: int) -> None:
        """Fill in what is kept of each slot of chunk `i`."""
        for term, values in enumerate(chunk.prediction.basis):
            self.basis[i, :, :, term] = values
        for axis in range(2):
            for a in range(2):
                self.shared[axis, a, i] = products.displacement_source[axis][a]

    def sum_local(self, chunk: Linearised, i: int) -> None:
        """Fill in `local` of chunk `i`."""
        rows = np.stack(_flatten([*chunk.local, chunk.residual]), axis=1)
        rows = rows.reshape(len(rows), N_LOCAL + 1, -1)
        np.matmul(rows, rows.swapaxes(1, 2), out=self.local[i])

    def sum_mixed(self, products: Products, i: int) -> None:
        """Fill in `mixed` of chunk `i`, whose slots are kept."""
        mixed = np.stack(_flatten(products.local_displacement), axis=1) @ self.basis[i]
        self.mixed[i] = mixed.reshape(self.mixed[i].shape)


def _flatten(nested: Iterable[Iterable[AnyArray]]) -> list[AnyArray]:
    """Return the arrays of a list of rows, row after row."""
    return [values for row in nested for values in row]
