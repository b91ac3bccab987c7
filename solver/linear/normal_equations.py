"""Normal equations of one orbit, accumulated from the data alone.

With calibration theta and sources s, half the data's chi2 has the Hessian blocks
U (theta, theta), W (theta, source) and V (source, source). V is block-diagonal, 2 x 2
for each source, since a measurement belongs to one source, which makes the sources cheap to
eliminate (`solver.linear.source_elimination`). Priors are added there, so that these blocks
stay valid when the priors change.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from solver.linear.chi2 import Gradient
from solver.linear.derivative_products import TiledDerivatives, one_by_one, tiled_derivatives
from solver.linear.linearised_chunks import linearised_chunks
from solver.linear.tile_sums import TileSums
from solver.linear.walk_sums import add_cross_walk, add_walks
from solver.model.forward import Index
from solver.problem.parameter_vector import VectorLayout
from solver.problem.problem import Problem
from solver.problem.source_blocks import SourceBlocks
from solver.problem.tiles import Gathering
from solver.runtime.threads import one_blas_thread


@dataclass(frozen=True)
class DetectorSums:
    """Contributions of the measurements on each detector to g, chi2_0 and the blocks.

    Of W they comprise only the rows of the distortion, since the others each belong to one
    detector; the sources of W are in block order.
    """

    chi2: Float[np.ndarray, " det"]
    by_theta: Float[np.ndarray, "det calib"]
    by_source: Float[np.ndarray, "det 2 src"]
    theta: Float[np.ndarray, "det calib calib"]
    source: Float[np.ndarray, "det 2 2 src"]
    coefficients: Float[np.ndarray, "det two_coef 2 src"]


@dataclass(frozen=True)
class NormalEquations:
    """Half of chi2 = chi2_0 - 2 g.d + d.H.d in the blocks of its gradient and Hessian.

    Attributes
    ----------
    at : linearisation point, calibration and sources
    gradient : g, with chi2_0
    theta : U
    source : V
    source_blocks : blocks whose order the sources of W follow
    cross : W
    by_detector : the same by detector; None if measurements were removed from the sums
    """

    at: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]
    gradient: Gradient
    theta: Float[np.ndarray, "calib calib"]
    source: Float[np.ndarray, "src 2 2"]
    source_blocks: SourceBlocks
    cross: Float[np.ndarray, "calib 2 src"]
    by_detector: DetectorSums | None


def accumulate(
    problem: Problem,
    theta: Float[np.ndarray, " calib"],
    sources: Float[np.ndarray, "src 2"],
    coefficients: Float[np.ndarray, "det 2 coef 2 coef"] | None = None,
) -> NormalEquations:
    """Accumulate the normal equations of the data at one point.

    Parameters
    ----------
    coefficients : the blocks between the distortion terms, by detector, if already computed;
        they depend on the ideal positions, not on the distortion
    """
    layout, n_src, index = problem.layout, problem.n_src, problem.measurements.tiles.index
    n_det, n_coef = layout.n_det, layout.n_terms
    cross = np.zeros((layout.size, 2, n_src))
    source, by_source = np.zeros((n_det, 2, 2, n_src)), np.zeros((n_det, 2, n_src))
    is_known = coefficients is not None
    term_blocks = coefficients if is_known else np.zeros((n_det, 2, n_coef, 2, n_coef))
    touched = layout.touched(index.exposure[..., 0], index.detector[..., 0])
    sums = TileSums.empty(index.source.shape, touched.shape[-1], n_coef, layout.n_walk)
    with one_blas_thread(), ThreadPoolExecutor(max_workers=1) as helper:
        pending = helper.submit(lambda: None)
        for i, chunk in enumerate(linearised_chunks(problem, theta, sources)):
            chunk_index, rows = Index(*(column[i] for column in index)), tiled_derivatives(chunk)
            sums.keep_slots(chunk, rows, i)
            # One chunk at a time, because chunks are large.
            pending.result()
            summed = None if is_known else term_blocks
            pending = helper.submit(_sum_in_tiles, rows, i, chunk_index.detector, sums, summed)
            by_row = one_by_one(rows.local, rows.source)
            _add_sources(chunk_index, rows.source, by_row[-1], source, by_source)
            in_order = chunk_index._replace(
                source=problem.source_blocks.position[chunk_index.source]
            )
            _add_cross_local(in_order.source, touched[i], by_row, cross)
            add_cross_walk(in_order, sums.shared[:, :, i], chunk.prediction.basis, layout, cross)
        pending.result()
        cross_by_detector = np.empty((n_det, 2 * n_coef, 2, n_src))
        first_half, second_half = slice(n_det // 2 + 1), slice(n_det // 2 + 1, n_det)
        # A cached property, computed before both threads need it.
        places = problem.measurements.by_source
        pending = helper.submit(_cross_coefficients, places, sums, first_half, cross_by_detector)
        hessian, by_theta, chi2 = _assemble(index, touched, layout, sums, term_blocks)
        _cross_coefficients(places, sums, second_half, cross_by_detector)
        pending.result()
    by_detector = DetectorSums(chi2, by_theta, by_source, hessian, source, cross_by_detector)
    np.sum(cross_by_detector, axis=0, out=cross[layout.coefficients()])
    return _summed((theta, sources), by_detector, problem.source_blocks, cross)


def _summed(
    at: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]],
    by_detector: DetectorSums,
    source_blocks: SourceBlocks,
    cross: Float[np.ndarray, "calib 2 src"],
) -> NormalEquations:
    """Return the normal equations of all detectors together; `cross` is W."""
    return NormalEquations(
        at=at,
        gradient=Gradient(
            float(by_detector.chi2.sum()),
            by_detector.by_theta.sum(axis=0),
            by_detector.by_source.sum(axis=0).T.copy(),
        ),
        theta=by_detector.theta.sum(axis=0),
        source=by_detector.source.sum(axis=0).transpose(2, 0, 1).copy(),
        source_blocks=source_blocks,
        cross=cross,
        by_detector=by_detector,
    )


def _sum_in_tiles(
    rows: TiledDerivatives,
    i: int,
    detector: Int[np.ndarray, "tile 1"],
    sums: TileSums,
    coefficients: Float[np.ndarray, "det 2 coef 2 coef"] | None,
) -> None:
    """Sum the products of chunk `i` over each tile, and add those between distortion terms."""
    sums.sum_local(rows, i)
    sums.sum_mixed(rows, i)
    if sums.walk.size:
        sums.sum_walk(rows, i)
    if coefficients is not None:
        _add_coefficients(detector, rows.displacement, sums.basis[i], coefficients)


def _add_coefficients(
    detector: Int[np.ndarray, "tile 1"],
    displacement: Float[np.ndarray, "tile 2 2 slot"],
    basis: Float[np.ndarray, "tile slot coef"],
    hessian: Float[np.ndarray, "det 2 coef 2 coef"],
) -> None:
    n_det, n_coef = len(hessian), basis.shape[-1]
    on_detector = (np.arange(n_det)[:, None] == detector.T).astype(np.float64)
    weight = one_by_one(displacement, displacement)
    weighted, of_tiles = np.empty(basis.shape), np.empty((len(basis), n_coef, n_coef))
    for i, j in ((0, 0), (0, 1), (1, 1)):
        np.multiply(weight[i, j, :, :, None], basis, out=weighted)
        np.matmul(weighted.swapaxes(1, 2), basis, out=of_tiles)
        sums = on_detector @ of_tiles.reshape(len(basis), n_coef * n_coef)
        hessian[:, i, :, j] += sums.reshape(n_det, n_coef, n_coef)
    hessian[:, 1, :, 0] = hessian[:, 0, :, 1].swapaxes(1, 2)


def _add_sources(
    index: Index,
    rows: Float[np.ndarray, "tile 2 2 slot"],
    by_residual: Float[np.ndarray, "2 tile slot"],
    hessian: Float[np.ndarray, "det 2 2 src"],
    gradient: Float[np.ndarray, "det 2 src"],
) -> None:
    n_det, _, n_src = gradient.shape
    pair = (index.detector * n_src + index.source).ravel()

    squares, totals = one_by_one(rows, rows), [(gradient[:, a], by_residual[a]) for a in (0, 1)]
    totals += [(hessian[:, a, b], squares[a, b]) for a, b in ((0, 0), (1, 0), (1, 1))]
    for total, values in totals:
        total += np.bincount(pair, values.ravel(), n_det * n_src).reshape(n_det, n_src)
    hessian[:, 0, 1] = hessian[:, 1, 0]


def _add_cross_local(
    source: Int[np.ndarray, "tile slot"],
    touched: Int[np.ndarray, "tile local"],
    by_row: Float[np.ndarray, "rows 2 tile slot"],
    cross: Float[np.ndarray, "calib 2 src"],
) -> None:
    """Add the blocks between the sources and the local parameters of their measurements.

    Parameters
    ----------
    source : places of the sources in block order
    touched : columns of the local parameters of each tile, of which `by_row` has the first rows
    """
    n_src, flat = cross.shape[-1], cross.reshape(-1)
    for number, columns in enumerate(touched.T):
        for a in range(2):
            place = (2 * columns[:, None] + a) * n_src + source
            np.add.at(flat, place.ravel(), by_row[number, a].ravel())


def _cross_coefficients(
    places: Gathering,
    sums: TileSums,
    detectors: slice,
    cross: Float[np.ndarray, "det two_coef 2 src"],
) -> None:
    """Fill in the blocks between sources and distortion.

    Each is a sum over the measurements of a source of a 2 x 2 matrix times the basis; together
    they are the product of a sparse matrix and the dense basis.
    """
    n_src, n_coef, filled = cross.shape[-1], sums.basis.shape[-1], cross[detectors]
    # Rows of the sparse matrix: four values of each source, detector after detector.
    begin = 4 * n_src * detectors.indices(len(cross))[0]
    first = places.first[begin : begin + 4 * n_src * len(filled) + 1]
    entries = slice(first[0], first[-1])
    weight = np.take(sums.shared.reshape(-1), places.value[entries])
    basis = sums.basis.reshape(sums.shared[0, 0].size, n_coef)
    gather = sp.csr_array(
        (weight, places.slot[entries], first - first[0]), shape=(len(first) - 1, len(basis))
    )
    summed = (gather @ basis).reshape(len(filled), n_src, 2, 2, n_coef)
    filled.reshape(len(filled), 2, n_coef, 2, n_src)[...] = summed.transpose(0, 2, 4, 3, 1)


def _assemble(
    index: Index,
    columns: Int[np.ndarray, "chunk tile local"],
    layout: VectorLayout,
    sums: TileSums,
    coefficients: Float[np.ndarray, "det 2 coef 2 coef"],
) -> tuple[
    Float[np.ndarray, "det calib calib"], Float[np.ndarray, "det calib"], Float[np.ndarray, " det"]
]:
    """Return Hessian, gradient and chi2 of the calibration for each detector.

    Parameters
    ----------
    columns : of the local parameters of each tile
    """
    size, n_det, shared, local = layout.size, layout.n_det, layout.coefficients(), slice(-1)
    detector = index.detector[..., 0]
    # Start of each detector's vector in the concatenated vectors.
    first = size * detector[..., None]
    rows = size * (first + columns)[..., :, None]
    n_values = n_det * size * size
    hessian = _sum_at(rows + columns[..., None, :], sums.local[..., local, local], n_values)
    hessian += _sum_at(rows + np.arange(size)[shared], sums.mixed[..., local, :], n_values)
    hessian = hessian.reshape(n_det, size, size)
    hessian[:, shared, :] = hessian[:, :, shared].swapaxes(1, 2)
    hessian[:, shared, shared] = coefficients.reshape(n_det, 2 * layout.n_terms, 2 * layout.n_terms)
    gradient = _sum_at(first + columns, sums.local[..., -1, local], n_det * size)
    gradient += _sum_at(first + np.arange(size)[shared], sums.mixed[..., -1, :], n_det * size)
    gradient = gradient.reshape(n_det, size)
    if layout.n_walk:
        add_walks(index, layout, sums, hessian, gradient)
    return hessian, gradient, _sum_at(detector, sums.local[..., -1, -1], n_det)


def _sum_at(
    places: Int[np.ndarray, "..."], values: Float[np.ndarray, "..."], length: int
) -> Float[np.ndarray, " _"]:
    """Return the sum of the values at each place."""
    # NumPy returns integers for empty input.
    return np.bincount(places.ravel(), values.ravel(), length).astype(np.float64, copy=False)
