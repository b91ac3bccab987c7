"""Normal equations of one orbit, accumulated from the data alone.

With calibration theta and sources s, half the data's chi2 has the Hessian blocks
U (theta, theta), W (theta, source) and V (source, source). V is block-diagonal, 2 x 2
for each source, since a measurement belongs to one source: this is what makes the
sources cheap to eliminate (`solver.schur`). Priors are added there, so that these blocks
outlive a change of the priors.
"""

from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache

import jax
import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from threadpoolctl import ThreadpoolController

from solver.forward import AnyArray, Index
from solver.layout import LOCAL_GROUPS, PER_DETECTOR, PER_EXPOSURE, Layout
from solver.linearise import Linearised, linearise, turning
from solver.objective import Gradient
from solver.problem import Problem

N_LOCAL = len(LOCAL_GROUPS)


@dataclass(frozen=True)
class NormalEquations:
    """Half of chi2 = chi2_0 - 2 g.d + d.H.d in the blocks of its gradient and Hessian.

    Attributes
    ----------
    at : where the model was linearised, calibration and sources
    gradient : g, with chi2_0
    theta : U
    source : V
    cross : W
    """

    at: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]
    gradient: Gradient
    theta: Float[np.ndarray, "calib calib"]
    source: Float[np.ndarray, "src 2 2"]
    cross: Float[np.ndarray, "calib 2 src"]


@dataclass(frozen=True)
class _TileSums:
    """What is summed within each tile, before it is known where it belongs.

    `local` holds the products of the derivatives by `LOCAL_GROUPS` and, last, the
    residual; `mixed` those with the distortion's two directions. `basis` and `shared`
    belong to each slot: the distortion terms, and the products of a displacement with the
    source.
    """

    local: Float[np.ndarray, "chunk tile local local"]
    mixed: Float[np.ndarray, "chunk tile local two_coef"]
    basis: Float[np.ndarray, "chunk tile slot coef"]
    shared: Float[np.ndarray, "2 2 chunk tile slot"]


def chunks(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> Iterator[Linearised]:
    """Linearise the measurements a chunk of tiles at a time.

    The next chunk is under way in JAX while the caller works on this one.
    """
    n_chunks = len(problem.tiles.measured)
    # Once, and not with every chunk.
    offsets, geometry = jax.device_put((problem.offsets(theta, sources), problem.geometry))
    turn = turning(offsets, geometry)

    def start(i: int) -> Linearised:
        return linearise(turn, offsets, geometry, *problem.tiles.chunk(i))

    ahead = start(0)
    for i in range(n_chunks):
        current = ahead
        if i + 1 < n_chunks:
            ahead = start(i + 1)
        yield jax.tree.map(np.asarray, current.with_terms(problem.layout.n_coef))


def one_blas_thread() -> AbstractContextManager[object]:
    """Keep BLAS to one thread while many small products are made.

    Its threads wait in a busy loop between products; beside JAX or a browser, on few
    cores, that was measured to make a pass up to twenty times slower.
    """
    return _thread_pools().limit(limits=1, user_api="blas")


@cache
def _thread_pools() -> ThreadpoolController:
    return ThreadpoolController()


def accumulate(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> NormalEquations:
    """Accumulate the normal equations of the data at one point."""
    layout, n_src, index = problem.layout, problem.n_src, problem.tiles.index
    cross = np.zeros((layout.size, 2, n_src))
    source, by_source = np.zeros((2, 2, n_src)), np.zeros((2, n_src))
    coefficients = np.zeros((2, layout.n_coef, 2, layout.n_coef))
    sums = _empty_sums(index.source.shape, layout.n_coef)
    with one_blas_thread():
        for i, chunk in enumerate(chunks(problem, theta, sources)):
            here = Index(*(part[i] for part in index))
            _sum_tiles(chunk, i, sums)
            _add_coefficients(chunk, sums.basis[i], coefficients)
            _add_sources(here.source, chunk, source, by_source)
            _add_cross_local(here, chunk, layout, cross)
        hessian, by_theta, chi2 = _assemble(index, layout, sums, coefficients)
    _add_cross_coefficients(problem, sums, cross)
    gradient = Gradient(chi2, by_theta, by_source.T.copy())
    at, of_sources = (theta, sources), source.transpose(2, 0, 1).copy()
    return NormalEquations(at, gradient, hessian, of_sources, cross)


def _flatten(nested: Iterable[Iterable[AnyArray]]) -> list[AnyArray]:
    """Return the arrays of a list of rows, row after row."""
    return [values for row in nested for values in row]


def _empty_sums(shape: tuple[int, ...], n_coef: int) -> _TileSums:
    tiles, rows = shape[:2], N_LOCAL + 1
    return _TileSums(
        np.empty((*tiles, rows, rows)),
        np.empty((*tiles, rows, 2 * n_coef)),
        np.empty((*shape, n_coef)),
        np.empty((2, 2, *shape)),
    )


def _sum_tiles(chunk: Linearised, i: int, sums: _TileSums) -> None:
    """Fill the sums of the tiles of chunk `i`, and what is kept of each slot."""
    products, basis = chunk.products, sums.basis[i]
    for term, values in enumerate(chunk.prediction.basis):
        basis[:, :, term] = values
    for axis in range(2):
        for a in range(2):
            sums.shared[axis, a, i] = products.displacement_source[axis][a]
    rows = np.stack(_flatten([*chunk.local, chunk.residual]), axis=1)
    rows = rows.reshape(len(rows), N_LOCAL + 1, -1)
    np.matmul(rows, rows.swapaxes(1, 2), out=sums.local[i])
    mixed = np.stack(_flatten(products.local_displacement), axis=1) @ basis
    sums.mixed[i] = mixed.reshape(sums.mixed[i].shape)


def _add_coefficients(
    chunk: Linearised,
    basis: Float[np.ndarray, "tile slot coef"],
    hessian: Float[np.ndarray, "2 coef 2 coef"],
) -> None:
    n_tiles, n_slots, n_coef = basis.shape
    terms = basis.reshape(n_tiles * n_slots, n_coef)
    for i, j in ((0, 0), (0, 1), (1, 1)):
        weight = chunk.products.displacement_displacement[i][j].reshape(-1, 1)
        hessian[i, :, j] += (weight * terms).T @ terms
    hessian[1, :, 0] = hessian[0, :, 1].T


def _add_sources(
    index: Int[np.ndarray, "tile slot"],
    chunk: Linearised,
    hessian: Float[np.ndarray, "2 2 src"],
    gradient: Float[np.ndarray, "2 src"],
) -> None:
    products, n_src, flat = chunk.products, gradient.shape[-1], index.ravel()
    for a in range(2):
        gradient[a] += np.bincount(flat, products.local_source[-1][a].ravel(), n_src)
        for b in range(a + 1):
            hessian[a, b] += np.bincount(flat, products.source_source[a][b].ravel(), n_src)
    hessian[0, 1] = hessian[1, 0]


def _add_cross_local(
    index: Index, chunk: Linearised, layout: Layout, cross: Float[np.ndarray, "calib 2 src"]
) -> None:
    """Add the blocks between the sources and what each of their measurements touches."""
    n_src = cross.shape[-1]
    for number, groups in ((index.exposure, PER_EXPOSURE), (index.detector, PER_DETECTOR)):
        first, count = number.min(), np.ptp(number) + 1
        pair = ((number - first) * n_src + index.source).ravel()
        for group in groups:
            columns = layout.columns(group)[first : first + count]
            products = chunk.products.local_source[LOCAL_GROUPS.index(group)]
            for a in range(2):
                sums = np.bincount(pair, products[a].ravel(), count * n_src)
                cross[columns, a] += sums.reshape(count, n_src)


def _add_cross_coefficients(
    problem: Problem, sums: _TileSums, cross: Float[np.ndarray, "calib 2 src"]
) -> None:
    """Add the blocks between sources and distortion, shared by all measurements.

    They are sums over the measurements of a source of a 2 x 2 matrix times the basis: a
    sparse matrix that gathers them, times the dense basis.
    """
    n_src, n_coef = problem.n_src, problem.layout.n_coef
    order, first = problem.slots_by_source
    basis = sums.basis.reshape(len(order), n_coef)
    target = cross[problem.layout.coefficients()].reshape(2, n_coef, 2, n_src)
    for axis in range(2):
        for a in range(2):
            weight = sums.shared[axis, a].reshape(-1)[order]
            gather = sp.csr_array((weight, order, first), shape=(n_src, len(basis)))
            target[axis, :, a] = (gather @ basis).T


def _assemble(
    index: Index,
    layout: Layout,
    sums: _TileSums,
    coefficients: Float[np.ndarray, "2 coef 2 coef"],
) -> tuple[Float[np.ndarray, "calib calib"], Float[np.ndarray, " calib"], float]:
    """Return Hessian, gradient and chi2 of the calibration."""
    size, shared, own = layout.size, layout.coefficients(), slice(N_LOCAL)
    columns = layout.touched(index.exposure[..., 0], index.detector[..., 0])
    row = size * columns[..., :, None]
    hessian = _sum_at(row + columns[..., None, :], sums.local[..., own, own], size * size)
    hessian += _sum_at(row + np.arange(size)[shared], sums.mixed[..., own, :], size * size)
    hessian = hessian.reshape(size, size)
    hessian[shared, :] = hessian[:, shared].T
    hessian[shared, shared] = coefficients.reshape(2 * layout.n_coef, 2 * layout.n_coef)
    gradient = _sum_at(columns, sums.local[..., -1, own], size)
    gradient[shared] = sums.mixed[..., -1, :].sum(axis=(0, 1))
    return hessian, gradient, float(sums.local[..., -1, -1].sum())


def _sum_at(
    places: Int[np.ndarray, "..."], values: Float[np.ndarray, "..."], length: int
) -> Float[np.ndarray, " _"]:
    """Return the sums of the values that fall on each place."""
    # Of nothing at all NumPy counts integers.
    return np.bincount(places.ravel(), values.ravel(), length).astype(np.float64, copy=False)
