"""Marginal covariances of all parameters, as far as measurements depend on them.

The covariance between the calibration and a source is needed only for the parameters that the
source's measurements depend on. With these ordered last, T = R'^-1 Z is zero in all other rows,
and only the last rows and columns of R are needed.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from solver.linear.source_elimination import ReducedSystem
from solver.linear.triangular import rows_solved, upper_solve
from solver.problem.source_blocks import SourceBlock, SourceBlocks
from solver.runtime.threads import one_blas_thread

_WORKERS = 2


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


class _Part(NamedTuple):
    """The rows of T of one source block that are not zero.

    Attributes
    ----------
    block : the source block
    columns : the calibration parameter of each row
    factor : rows and columns of R that belong to these parameters, ordered last
    rows : the rows of T
    """

    block: SourceBlock
    columns: Int[np.ndarray, " touched"]
    factor: Float[np.ndarray, "touched touched"]
    rows: Float[np.ndarray, "touched 2 _"]


def covariances(reduced: ReducedSystem) -> Covariances:
    """Return the marginal covariances of a factorised posterior."""
    in_order = reduced.source_factor[reduced.source_blocks.order]
    own_cross = np.zeros((len(reduced.factor), 2, len(in_order)))

    def fill_in(part: _Part) -> None:
        places = part.block.places
        solved = rows_solved(part.factor, part.rows, trans=False, scale=-1.0)
        own_cross[part.columns, :, places] = upper_solve(in_order[places], solved)

    source = _marginal(reduced, fill_in)
    return Covariances(
        reduced.at, source, reduced.theta_covariance(), own_cross, reduced.source_blocks
    )


def marginal_covariance(reduced: ReducedSystem) -> Float[np.ndarray, "src 2 2"]:
    """Return the covariance of each source with the calibration integrated out, mas^2."""
    return _marginal(reduced, lambda part: None)


def cross_covariance(reduced: ReducedSystem) -> Float[np.ndarray, "calib 2 src"]:
    """Return the covariance of the whole calibration with each source, -S^-1 W V^-1.

    The sources are in block order. It takes four times as long as the part in `Covariances`.
    """
    solved = rows_solved(reduced.factor, reduced.spread(), trans=False, scale=-1.0)
    return upper_solve(reduced.source_factor[reduced.source_blocks.order], solved)


def _marginal(reduced: ReducedSystem, use: Callable[[_Part], None]) -> Float[np.ndarray, "src 2 2"]:
    """Return the marginal covariances of the sources.

    Parameters
    ----------
    use : called with the rows of T of each source block, which it may overwrite; in two threads
    """
    blocks, n_calib = reduced.source_blocks, len(reduced.factor)
    inner = np.empty((2, 2, len(reduced.source_factor)))

    def of_block(
        number: int, order: Int[np.ndarray, " calib"], factor: Float[np.ndarray, "calib calib"]
    ) -> None:
        block, matrix = blocks.blocks[number], reduced.whitened[number]
        own = slice(n_calib - len(matrix), None)
        columns, factor = order[own], factor[own, own]
        rows = rows_solved(factor, matrix[np.searchsorted(block.columns, columns)], trans=True)
        for a, b in ((0, 0), (0, 1), (1, 1)):
            product = np.einsum("ks,ks->s", rows[:, a], rows[:, b])
            inner[a, b, block.places] = inner[b, a, block.places] = product + (a == b)
        use(_Part(block, columns, factor, rows))

    with one_blas_thread(), ThreadPoolExecutor(max_workers=_WORKERS) as helpers:
        chains = blocks.chains()
        orders = [blocks.last(chain, n_calib) for chain in chains]
        factors = list(helpers.map(lambda order: _reordered(reduced.factor, order), orders))
        work = [
            (number, order, factor)
            for chain, order, factor in zip(chains, orders, factors, strict=True)
            for number in chain
        ]
        # The largest first, so that both threads end at about the same time.
        work.sort(key=lambda one: -len(reduced.whitened[one[0]]) * reduced.whitened[one[0]].size)
        for _ in helpers.map(lambda one: of_block(*one), work):
            pass
    half = upper_solve(reduced.source_factor, inner[:, :, blocks.position])
    return upper_solve(reduced.source_factor, half.swapaxes(0, 1)).transpose(2, 1, 0).copy()


def _reordered(
    factor: Float[np.ndarray, "calib calib"], order: Int[np.ndarray, " calib"]
) -> Float[np.ndarray, "calib calib"]:
    """Return the factor R of S with its rows and columns in another order.

    It is computed from R. From S it would be faster, but the inverse of S amplifies rounding
    errors of S, and covariances from differently ordered factors have to agree.
    """
    if (order[:-1] < order[1:]).all():
        return factor
    return np.asarray(np.linalg.qr(factor[:, order], mode="r"))
