"""Normal equations of one orbit, accumulated from the data alone.

With calibration theta and sources s, half the data's chi2 has the Hessian blocks
U (theta, theta), W (source, theta) and V (source, source). V is block-diagonal, 2 x 2
for each source, since a measurement belongs to one source: this is what makes the
sources cheap to eliminate (`solver.schur`). Priors are added there, so that these blocks
outlive a change of the priors.
"""

from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import jax
import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from threadpoolctl import ThreadpoolController

from solver.forward import Index, Offsets
from solver.layout import PER_DETECTOR, PER_EXPOSURE, Layout
from solver.linearise import Linearised, linearise
from solver.problem import Problem

# Long enough to keep the vector units busy, short enough to bound memory; one size means
# one compilation, whatever the number of measurements.
CHUNK = 16_384


@dataclass(frozen=True)
class NormalEquations:
    """Half of chi2 = chi2_0 - 2 g.d + d.H.d in the blocks of its gradient and Hessian.

    Attributes
    ----------
    chi2 : of the data, at the linearisation point
    by_theta : minus the gradient by the calibration
    by_source : minus the gradient by the sources
    theta : U
    source : V
    cross : W
    """

    chi2: float
    by_theta: Float[np.ndarray, " calib"]
    by_source: Float[np.ndarray, "src 2"]
    theta: Float[np.ndarray, "calib calib"]
    source: Float[np.ndarray, "src 2 2"]
    cross: Float[np.ndarray, "src 2 calib"]


class Segment(NamedTuple):
    """Measurements of one exposure on one detector, within one chunk.

    `rows` are positions in the chunk, `source` the source of each, `columns` are
    the runs of calibration parameters that they touch, `jacobian` the derivatives by those.
    """

    rows: slice
    exposure: int
    detector: int
    source: Int[np.ndarray, " seg"]
    columns: tuple[slice, ...]
    jacobian: Float[np.ndarray, "seg 2 local"]


def chunks(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> Iterator[tuple[slice, Linearised]]:
    """Linearise the measurements a chunk at a time; yields their range and the chunk.

    The next chunk is under way in JAX while the caller works on this one.
    """
    offsets = problem.offsets(theta, sources)
    starts = range(0, problem.n_obs, CHUNK)
    ahead = _start_chunk(problem, offsets, 0)
    for first in starts:
        current = ahead
        if first + CHUNK < problem.n_obs:
            ahead = _start_chunk(problem, offsets, first + CHUNK)
        rows = slice(first, min(first + CHUNK, problem.n_obs))
        yield rows, _to_numpy(current, rows.stop - first)


def one_blas_thread() -> AbstractContextManager[object]:
    """Keep BLAS to one thread while many small products are made.

    Its threads wait in a busy loop between products; beside JAX or a browser, on few
    cores, that was measured to make a pass up to twenty times slower.
    """
    return _thread_pools().limit(limits=1, user_api="blas")


@cache
def _thread_pools() -> ThreadpoolController:
    return ThreadpoolController()


def _start_chunk(problem: Problem, offsets: Offsets, first: int) -> Linearised:
    # The last row is repeated up to a full chunk, with no weight.
    take = np.minimum(np.arange(first, first + CHUNK), problem.n_obs - 1)
    weight = 1.0 / problem.sigma[take]
    weight[problem.n_obs - first :] = 0.0
    index = Index(*(column[take] for column in problem.index))
    return linearise(offsets, problem.geometry, index, problem.measured[take], weight)


def segments(problem: Problem, rows: slice, chunk: Linearised) -> Iterator[Segment]:
    """Yield the segments of a chunk with their Jacobians by the calibration."""
    layout = problem.layout
    source, exposure, detector = (column[rows] for column in problem.index)
    changes = np.flatnonzero(np.diff(exposure) | np.diff(detector)) + 1
    for first, last in zip([0, *changes], [*changes, len(exposure)], strict=True):
        here = slice(first, last)
        m, n = int(exposure[first]), int(detector[first])
        yield Segment(
            here,
            m,
            n,
            source[here],
            layout.touched(m, n),
            _calibration_jacobian(chunk, here),
        )


def accumulate(
    problem: Problem, theta: Float[np.ndarray, " calib"], sources: Float[np.ndarray, "src 2"]
) -> NormalEquations:
    """Accumulate the normal equations of the data at one point."""
    layout, n_src = problem.layout, problem.n_src
    hessian, gradient = np.zeros((layout.size, layout.size)), np.zeros(layout.size)
    cross, on_sources = np.zeros((n_src, 2, layout.size)), np.zeros((n_src, 2))
    source, chi2 = np.zeros((n_src, 2, 2)), 0.0
    by_exposure = np.empty((problem.n_obs, 2, len(PER_EXPOSURE)))
    by_detector = np.empty((problem.n_obs, 2, len(PER_DETECTOR)))
    with one_blas_thread():
        for rows, chunk in chunks(problem, theta, sources):
            chi2 += float(np.vdot(chunk.residual, chunk.residual))
            _add_sources(problem.index.source[rows], chunk, source, on_sources)
            _add_cross_coefficients(problem.index.source[rows], chunk, layout, cross)
            by_exposure[rows], by_detector[rows] = chunk.products.exposure, chunk.products.detector
            for segment in segments(problem, rows, chunk):
                flat = segment.jacobian.reshape(-1, segment.jacobian.shape[-1])
                columns = np.r_[segment.columns]
                hessian[np.ix_(columns, columns)] += flat.T @ flat
                gradient[columns] += chunk.residual[segment.rows].ravel() @ flat
    _add_cross_exposures(problem, by_exposure, cross)
    _add_cross_detectors(problem.index, by_detector, layout, cross)
    return NormalEquations(chi2, gradient, on_sources, hessian, source, cross)


def _to_numpy(chunk: Linearised, length: int) -> Linearised:
    return jax.tree.map(lambda values: np.asarray(values)[:length], chunk)


def _calibration_jacobian(chunk: Linearised, here: slice) -> Float[np.ndarray, "seg 2 local"]:
    """Join the derivatives by exposure, distortion and detector of one segment."""
    by_coefficient = [
        chunk.displacement[here, :, axis, None] * chunk.prediction.basis[here, None, :]
        for axis in range(2)
    ]
    return np.concatenate([chunk.exposure[here], *by_coefficient, chunk.detector[here]], axis=-1)


def _add_sources(
    index: Int[np.ndarray, " obs"],
    chunk: Linearised,
    hessian: Float[np.ndarray, "src 2 2"],
    gradient: Float[np.ndarray, "src 2"],
) -> None:
    n_src, products = len(hessian), chunk.products
    for a in range(2):
        for b in range(2):
            hessian[:, a, b] += np.bincount(index, products.source[:, a, b], n_src)
        gradient[:, a] += np.bincount(index, products.residual[:, a], n_src)


def _add_cross_coefficients(
    index: Int[np.ndarray, " obs"],
    chunk: Linearised,
    layout: Layout,
    cross: Float[np.ndarray, "src 2 calib"],
) -> None:
    """Add the blocks between sources and distortion, shared by all of a source's rows.

    They are sums over the measurements of a source of a 2 x 2 matrix times the basis: a
    sparse matrix that gathers them, times the dense basis.
    """
    first, count = layout.first_coefficient, layout.n_coef
    for a in range(2):
        for axis in range(2):
            gather = sp.csr_matrix(
                (chunk.products.displacement[:, a, axis], (index, np.arange(len(index)))),
                shape=(len(cross), len(index)),
            )
            columns = slice(first + axis * count, first + (axis + 1) * count)
            cross[:, a, columns] += gather @ chunk.prediction.basis


def _add_cross_exposures(
    problem: Problem,
    products: Float[np.ndarray, "obs 2 per_exp"],
    cross: Float[np.ndarray, "src 2 calib"],
) -> None:
    """Add the blocks between sources and exposures, one for each measurement.

    Source after source, so that what is written lies together.
    """
    order = np.argsort(problem.index.source, kind="stable")
    size, width = problem.layout.size, products.shape[-1]
    first = 2 * size * problem.index.source[order] + width * problem.index.exposure[order]
    places = first[:, None, None] + size * np.arange(2)[:, None] + np.arange(width)
    np.add.at(cross.reshape(-1), places.ravel(), products[order].ravel())


def _add_cross_detectors(
    index: Index,
    products: Float[np.ndarray, "obs 2 per_det"],
    layout: Layout,
    cross: Float[np.ndarray, "src 2 calib"],
) -> None:
    """Add the blocks between sources and detectors, summed over the exposures."""
    pair = index.source * layout.n_det + index.detector
    for a in range(2):
        for k in range(products.shape[-1]):
            sums = np.bincount(pair, products[:, a, k], len(cross) * layout.n_det)
            columns = slice(layout.first_detector + k, layout.size, products.shape[-1])
            cross[:, a, columns] += sums.reshape(len(cross), layout.n_det)
