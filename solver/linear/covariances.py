"""Marginal covariances of all parameters, as far as measurements depend on them.

The covariance between the calibration and a source is needed only for the parameters that the
source's measurements depend on, those of its block. With S^-1 = Q'Q among them, and the block's Z,
the whitened marginal covariance of source i is I + (Q Z_i)'Q Z_i, and -Q'Q Z_i its covariance with
the parameters. Q Z differs from the T of `solver.linear.source_elimination` by a rotation only.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float

from solver.linear.source_elimination import ReducedSystem
from solver.linear.triangular import (
    rows_solved,
    upper_solve,
    upper_times,
    upper_transposed_times,
)
from solver.problem.source_blocks import SourceBlock, SourceBlocks
from solver.runtime.threads import one_blas_thread

_WORKERS = 2
_UseCross = Callable[[SourceBlock, np.ndarray], None]


class Covariances(NamedTuple):
    """Marginal covariances of sources, calibration, and between the two.

    Attributes
    ----------
    at : linearisation point, calibration and sources
    source : of each source
    theta : of the calibration
    own_cross : of the calibration with each source, in block order; zero for the parameters that
        no measurement of the source's block depends on
    source_blocks : blocks of the sources
    """

    at: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]
    source: Float[np.ndarray, "src 2 2"]
    theta: Float[np.ndarray, "calib calib"]
    own_cross: Float[np.ndarray, "calib 2 src"]
    source_blocks: SourceBlocks


def covariances(reduced: ReducedSystem) -> Covariances:
    """Return the marginal covariances of a factorised posterior."""
    in_order = reduced.source_factor[reduced.source_blocks.order]
    own_cross = np.zeros((len(reduced.factor), 2, len(in_order)))

    def fill_in(block: SourceBlock, whitened: Float[np.ndarray, "touched 2 _"]) -> None:
        cross = upper_solve(in_order[block.places], whitened)
        own_cross[block.columns, :, block.places] = np.negative(cross, out=cross)

    inverse, source = _marginal(reduced, fill_in)
    theta = inverse @ inverse.T
    return Covariances(reduced.at, source, theta, own_cross, reduced.source_blocks)


def marginal_covariance(reduced: ReducedSystem) -> Float[np.ndarray, "src 2 2"]:
    """Return the covariance of each source with the calibration integrated out, mas^2."""
    return _marginal(reduced)[1]


def cross_covariance(reduced: ReducedSystem) -> Float[np.ndarray, "calib 2 src"]:
    """Return the covariance of the whole calibration with each source, -S^-1 W V^-1.

    The sources are in block order. It takes four times as long as the part in `Covariances`.
    """
    solved = rows_solved(reduced.factor, reduced.spread(), trans=False, scale=-1.0)
    return upper_solve(reduced.source_factor[reduced.source_blocks.order], solved)


def _marginal(
    reduced: ReducedSystem, use_cross: _UseCross | None = None
) -> tuple[Float[np.ndarray, "calib calib"], Float[np.ndarray, "src 2 2"]]:
    """Return R^-1, and the marginal covariances of the sources.

    Parameters
    ----------
    use_cross : called in two threads with each source block and minus the covariance of its
        parameters with its whitened sources
    """
    blocks, inner = reduced.source_blocks, np.empty((2, 2, len(reduced.source_factor)))
    inverse, _ = sl.lapack.dtrtri(reduced.factor)

    def of_block(number: int) -> None:
        block, matrix = blocks.blocks[number], reduced.whitened[number]
        # Q'Q is the covariance of the block's parameters. Computed from S, Q would be too
        # inaccurate: its rounding errors would have to cancel those of the whole covariance.
        root = np.asarray(np.linalg.qr(inverse[block.columns].T, mode="r"))
        rows = upper_times(root, matrix.reshape(len(matrix), -1))
        spread = rows.reshape(matrix.shape)
        for a, b in ((0, 0), (0, 1), (1, 1)):
            product = np.einsum("ks,ks->s", spread[:, a], spread[:, b])
            inner[a, b, block.places] = inner[b, a, block.places] = product + (a == b)
        if use_cross is not None:
            use_cross(block, upper_transposed_times(root, rows).reshape(matrix.shape))

    # The largest first, so that both threads end at about the same time.
    order = sorted(
        range(len(blocks.blocks)),
        key=lambda number: -len(reduced.whitened[number]) * reduced.whitened[number].size,
    )
    with one_blas_thread(), ThreadPoolExecutor(max_workers=_WORKERS) as helpers:
        # Iterated over, so that exceptions are raised.
        for _ in helpers.map(of_block, order):
            pass
    half = upper_solve(reduced.source_factor, inner[:, :, blocks.position])
    source = upper_solve(reduced.source_factor, half.swapaxes(0, 1)).transpose(2, 1, 0).copy()
    return inverse, source
