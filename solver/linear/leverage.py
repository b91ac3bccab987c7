"""Leverage: how far each measurement pulls its own prediction, and residuals corrected for it.

With the whitened Jacobian J_k of measurement k and the marginal covariance C of all
parameters, H_k = J_k C J_k' (2 x 2). The expected chi2 of the measurement is
2 - tr H_k, and (I - H_k)^(-1/2) r_k has unit covariance if model and sigmas are right.

A measurement depends on few parameters, and on the distortion's many coefficients only
through the displacement that they add at its position; so C is first projected onto the
source, the parameters of the local groups and that displacement.
"""

from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from solver.linear.derivative_products import side_by_side
from solver.linear.linearise import Linearised
from solver.linear.normal_equations import chunks, one_blas_thread
from solver.linear.source_elimination import ReducedSystem
from solver.model.forward import Index, Pair
from solver.problem.parameter_vector import VectorLayout
from solver.problem.problem import Problem
from solver.problem.source_blocks import SourceBlocks


class Residuals(NamedTuple):
    """Residuals of the measurements, in working order.

    `whitened` is (measured minus predicted) / sigma; `standardised` the same corrected for
    leverage, NaN where a measurement determines its own prediction; `trace` is that of H;
    the positions are those of `solver.model.forward.Prediction`.
    """

    whitened: Float[np.ndarray, "obs 2"]
    standardised: Float[np.ndarray, "obs 2"]
    trace: Float[np.ndarray, " obs"]
    pixel: Float[np.ndarray, "obs 2"]
    ideal: Float[np.ndarray, "obs 2"]
    focal: Float[np.ndarray, "obs 2"]


class Covariances(NamedTuple):
    """Marginal covariances of sources, calibration, and between the two.

    `at` is the linearisation point, calibration and sources. The sources of `cross` are in
    block order.
    """

    at: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]
    source: Float[np.ndarray, "src 2 2"]
    theta: Float[np.ndarray, "calib calib"]
    cross: Float[np.ndarray, "calib 2 src"]
    source_blocks: SourceBlocks


def covariances(reduced: ReducedSystem) -> Covariances:
    """Return all marginal covariances of a factorised posterior."""
    spread = reduced.spread()
    return Covariances(
        reduced.at,
        reduced.marginal_covariance(spread),
        reduced.theta_covariance(),
        reduced.cross_covariance(spread),
        reduced.source_blocks,
    )


def residuals(
    problem: Problem,
    theta: Float[np.ndarray, " calib"],
    sources: Float[np.ndarray, "src 2"],
    covariance: Covariances,
) -> Residuals:
    """Return the residuals and their leverage at a point."""
    tiles = problem.measurements.tiles

    def of_chunk(
        i: int, chunk: Linearised, jacobians: Linearised
    ) -> list[Float[np.ndarray, "..."]]:
        index = Index(*(column[i] for column in tiles.index))
        leverage = _leverage(index, jacobians, problem.layout, covariance)
        at = chunk.prediction
        return [leverage, *map(of_slots, (chunk.residual, at.pixel, at.ideal, at.focal))]

    parts, pending = [], deque()
    with one_blas_thread(), ThreadPoolExecutor(max_workers=2) as helpers:
        # Along prior-dominated directions large variances cancel, but only with the Jacobians
        # from which the covariances were computed.
        both = zip(chunks(problem, theta, sources), chunks(problem, *covariance.at), strict=True)
        for i, (chunk, jacobians) in enumerate(both):
            pending.append(helpers.submit(of_chunk, i, chunk, jacobians))
            # Few at a time, because chunks are large.
            if len(pending) > 2:
                parts.append(pending.popleft().result())
        parts += [work.result() for work in pending]
    leverage, residual, pixel, ideal, focal = (
        np.concatenate(columns)[tiles.place] for columns in zip(*parts, strict=True)
    )
    trace = np.trace(leverage, axis1=1, axis2=2)
    return Residuals(residual, _standardised(residual, leverage), trace, pixel, ideal, focal)


def of_slots(pair: Pair) -> Float[np.ndarray, "slots 2"]:
    """Return x and y of every slot of a chunk."""
    return np.stack([values.ravel() for values in pair], axis=-1)


def _leverage(
    index: Index, chunk: Linearised, layout: VectorLayout, covariance: Covariances
) -> Float[np.ndarray, "slots 2 2"]:
    """Return J C J' of every slot of a chunk."""
    source, local, displacement = map(side_by_side, (chunk.source, chunk.local, chunk.displacement))
    of_local, with_displacement, of_displacement = _calibration_covariance(
        index, chunk.prediction.basis, layout, covariance.theta
    )
    source_local, source_displacement = _source_covariance(
        index._replace(source=covariance.source_blocks.position[index.source]),
        chunk.prediction.basis,
        layout,
        covariance.cross,
    )
    spread = (of_local @ local.reshape(*local.shape[:2], -1)).reshape(local.shape)
    leverage = np.einsum("tips,tiqs->tpqs", local, spread)
    for rows, between, columns in (
        (source, covariance.source[index.source].transpose(0, 2, 3, 1), source),
        (displacement, of_displacement, displacement),
    ):
        leverage += _between(rows, between, columns)
    for rows, between, columns in (
        (local, source_local, source),
        (displacement, source_displacement, source),
        (local, with_displacement, displacement),
    ):
        half = _between(rows, between, columns)
        leverage += half + half.swapaxes(1, 2)
    return leverage.transpose(0, 3, 1, 2).reshape(-1, 2, 2)


def _between(
    rows: Float[np.ndarray, "tile i 2 slot"],
    covariance: Float[np.ndarray, "tile i j slot"],
    columns: Float[np.ndarray, "tile j 2 slot"],
) -> Float[np.ndarray, "tile 2 2 slot"]:
    # All loops run along the slots, which are the last axis.
    spread = np.einsum("tijs,tjqs->tiqs", covariance, columns)
    return np.einsum("tips,tiqs->tpqs", rows, spread)


def _calibration_covariance(
    index: Index,
    basis: list[Float[np.ndarray, "tile slot"]],
    layout: VectorLayout,
    theta: Float[np.ndarray, "calib calib"],
) -> tuple[
    Float[np.ndarray, "tile local local"],
    Float[np.ndarray, "tile local 2 slot"],
    Float[np.ndarray, "tile 2 2 slot"],
]:
    """Return the covariances of the parameters of the local groups and of the displacement.

    In this order: of the parameters, between parameters and displacement, of the displacement.
    """
    own, shared = layout.touched(index.exposure[:, 0], index.detector[:, 0]), layout.coefficients()
    n_tiles, n_slots = index.source.shape
    terms = _terms(basis, index.source.shape)
    n_rows = 2 * own.shape[-1]
    between = theta[own][:, :, shared].reshape(n_tiles, n_rows, layout.n_terms)
    mixed = (between @ terms).reshape(n_tiles, own.shape[-1], 2, n_slots)
    blocks = theta[shared, shared].reshape(2, layout.n_terms, 2, layout.n_terms)
    of_displacement = np.empty((n_tiles, 2, 2, n_slots))
    for i in range(2):
        for j in range(2):
            spread = blocks[i, :, j] @ terms
            of_displacement[:, i, j] = np.einsum("tcs,tcs->ts", terms, spread)
    return theta[own[:, :, None], own[:, None, :]], mixed, of_displacement


def _source_covariance(
    index: Index,
    basis: list[Float[np.ndarray, "tile slot"]],
    layout: VectorLayout,
    cross: Float[np.ndarray, "calib 2 src"],
) -> tuple[Float[np.ndarray, "tile local 2 slot"], Float[np.ndarray, "tile 2 2 slot"]]:
    """Return the covariances of these parameters and of the displacement with the source."""
    own = layout.touched(index.exposure[:, 0], index.detector[:, 0])
    source = index.source[:, None, :]
    of_local = np.stack([cross[own[:, :, None], a, source] for a in range(2)], axis=2)
    terms = _terms(basis, index.source.shape)
    of_terms = cross[layout.coefficients()].reshape(2, layout.n_terms, *cross.shape[1:])
    of_displacement = np.empty((len(own), 2, 2, terms.shape[-1]))
    for i in range(2):
        for a in range(2):
            here = of_terms[i, :, a].T[index.source]
            of_displacement[:, i, a] = np.einsum("tsc,tcs->ts", here, terms)
    return of_local, of_displacement


def _terms(
    basis: list[Float[np.ndarray, "tile slot"]], shape: tuple[int, int]
) -> Float[np.ndarray, "tile coef slot"]:
    return np.stack(basis, axis=1) if basis else np.empty((shape[0], 0, shape[1]))


def _standardised(
    residual: Float[np.ndarray, "obs 2"], leverage: Float[np.ndarray, "obs 2 2"]
) -> Float[np.ndarray, "obs 2"]:
    """Return (I - H)^(-1/2) r, by the closed form of a 2 x 2 root."""
    rest = np.eye(2) - leverage
    determinant = rest[:, 0, 0] * rest[:, 1, 1] - rest[:, 0, 1] * rest[:, 1, 0]
    # Below this the measurement determines its own prediction, and its residual is rounding noise.
    usable = (determinant > 1e-12) & (np.trace(rest, axis1=1, axis2=2) > 0.0)
    root = np.sqrt(np.where(usable, determinant, 1.0))
    trace = np.where(usable, np.trace(rest, axis1=1, axis2=2), 1.0)
    scale = np.sqrt(trace + 2.0 * root)
    square_root = (rest + root[:, None, None] * np.eye(2)) / scale[:, None, None]
    square_root[~usable] = np.eye(2)
    solved = np.linalg.solve(square_root, residual[:, :, None])[:, :, 0]
    solved[~usable] = np.nan
    return solved
