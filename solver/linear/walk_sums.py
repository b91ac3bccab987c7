"""Rows and columns of walking distortion terms in the normal equations.

A walking term has one coefficient for each exposure. Its derivatives are those of the constant term
at the measurements of the exposure, so that its sums over a tile are part of those of the
constant terms.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from solver.linear.tile_sums import TileSums
from solver.model.forward import Index
from solver.problem.parameter_vector import VectorLayout


class _Pairs(NamedTuple):
    """The pairs of an exposure and a detector that have tiles."""

    first: Int[np.ndarray, " pair"]
    exposure: Int[np.ndarray, " pair"]
    detector: Int[np.ndarray, " pair"]


def add_walks(
    index: Index,
    layout: VectorLayout,
    sums: TileSums,
    hessian: Float[np.ndarray, "det calib calib"],
    gradient: Float[np.ndarray, "det calib"],
) -> None:
    """Fill in the rows and columns of the walking terms.

    Parameters
    ----------
    hessian, gradient : of the calibration for each detector
    """
    pairs = _pairs(index)
    detector = pairs.detector[:, None, None]
    walked = layout.walked(pairs.exposure)
    local = layout.touched(pairs.exposure, pairs.detector)
    shared = np.arange(layout.size)[layout.coefficients()]
    mixed = _by_pair(sums.mixed, pairs)[:, :, layout.walking]
    of_terms = _by_pair(sums.walk, pairs).reshape(*walked.shape, -1)
    hessian[detector, walked[:, :, None], shared] = of_terms
    hessian[detector, shared[:, None], walked[:, None]] = of_terms.swapaxes(1, 2)
    hessian[detector, walked[:, :, None], walked[:, None]] = of_terms[:, :, layout.walking]
    hessian[detector, local[:, :, None], walked[:, None]] = mixed[:, :-1]
    hessian[detector, walked[:, :, None], local[:, None]] = mixed[:, :-1].swapaxes(1, 2)
    gradient[detector[:, 0], walked] = mixed[:, -1]


def add_cross_walk(
    index: Index,
    shared: Float[np.ndarray, "2 2 tile slot"],
    basis: list[Float[np.ndarray, "tile slot"]],
    layout: VectorLayout,
    cross: Float[np.ndarray, "calib 2 src"],
) -> None:
    """Add the blocks between the sources and the walking terms at their measurements.

    Parameters
    ----------
    shared : products of the derivatives by displacement and by source
    """
    n_src, flat = cross.shape[-1], cross.reshape(-1)
    walked = layout.walked(index.exposure)
    for number in range(2 * layout.n_walk):
        direction, term = divmod(number, layout.n_walk)
        for a in range(2):
            place = (2 * walked[..., number] + a) * n_src + index.source
            values = shared[direction, a] * basis[term]
            np.add.at(flat, place.ravel(), values.ravel())


def _pairs(index: Index) -> _Pairs:
    """Return the pairs in order of their tiles, which are adjacent."""
    exposure, detector = index.exposure.ravel(), index.detector.ravel()
    changes = np.flatnonzero(np.diff(exposure) | np.diff(detector)) + 1
    first = np.concatenate([[0], changes])
    return _Pairs(first, exposure[first], detector[first])


def _by_pair(
    values: Float[np.ndarray, "chunk tile ..."], pairs: _Pairs
) -> Float[np.ndarray, "pair ..."]:
    """Return the sums of values of tiles over the tiles of each pair."""
    return np.add.reduceat(values.reshape(-1, *values.shape[2:]), pairs.first, axis=0)
