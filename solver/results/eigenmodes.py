"""Eigenmodes of the calibration: which combinations of parameters the data determine.

The reduced matrix S = U + P - sum_i W_i V_i^-1 W_i' is the sum of a term of the measurements
alone, of the calibration's priors P, and of a term of each source's prior Q_i: with the data's
V_i, W_i (V_i^-1 - (V_i + Q_i)^-1) W_i'. So along a combination v with v'Sv = 1 the shares of
measurements, reference sources, other sources and every prior are numbers that add up to one,
independent of the order in which they are attributed.

An *eigenmode* is an eigenvector of S_data v = lambda S v; lambda is the share of the
measurements. Where lambda is close to zero, eigenvectors are arbitrary axes of the space that the
measurements do not constrain; there the eigenmodes are the axes of simple structure.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import scipy.linalg as sl
from jaxtyping import Bool, Float

from solver.linear.source_elimination import ReducedSystem
from solver.linear.triangular import upper_transposed_times
from solver.problem.parameter_vector import VectorLayout
from solver.problem.priors import Priors
from solver.problem.source_blocks import SourceBlock
from solver.results.simple_structure import joint_axes
from solver.runtime.interruption import give_way
from solver.runtime.threads import one_blas_thread

WEAK = 0.5
"""Share of the measurements below which an eigenmode is weak."""
MAX_NAMED = 12
"""Maximum number of weak eigenmodes with names, parameters and shifts."""
# Share of the measurements below which an eigenmode counts as unconstrained by them.
_UNCONSTRAINED = 1e-3
# Eigenmodes are mixed only if their relative information is within this factor.
_GAP = 10.0
_WORKERS = 2
# Share of the data below which they do not constrain a direction of a source.
_NEGLIGIBLE = 1e-12


class Eigenmodes(NamedTuple):
    """All eigenmodes, the least constrained by the measurements first.

    Attributes
    ----------
    vectors : eigenmodes as columns, each one posterior standard deviation long
    data : share of the measurements in the information about the eigenmode, lambda
    references, sources : shares of the priors of reference sources and of the other sources
    calibration : share of the calibration's priors
    relative : v'Sv over the sum of v_j^2 / (conditional variance of j): information about
        the eigenmode, relative to that of its parameters if the others were fixed
    """

    vectors: Float[np.ndarray, "calib calib"]
    data: Float[np.ndarray, " calib"]
    references: Float[np.ndarray, " calib"]
    sources: Float[np.ndarray, " calib"]
    calibration: Float[np.ndarray, " calib"]
    relative: Float[np.ndarray, " calib"]

    @property
    def n_weak(self) -> int:
        """Number of eigenmodes with a share of the measurements below `WEAK`."""
        return int((self.data < WEAK).sum())


class _PriorTerms(NamedTuple):
    """S^-1/2 (matrix) S^-1/2' of the source priors' terms of S, and R^-1 with S = R'R.

    `scaled` returns vectors in units of the calibration's priors.
    """

    references: Float[np.ndarray, "calib calib"]
    sources: Float[np.ndarray, "calib calib"]
    root: Float[np.ndarray, "calib calib"]
    scaled: Callable[[Float[np.ndarray, "calib k"]], Float[np.ndarray, "calib k"]]


def find_eigenmodes(
    reduced: ReducedSystem,
    priors: Priors,
    layout: VectorLayout,
    is_reference: Bool[np.ndarray, " src"],
) -> Eigenmodes:
    """Return the eigenmodes of a factorised posterior.

    In the weakest directions all but 1e-11 of the information of single parameters cancels in
    S, so rounding hides shares of the measurements below about 1e-3 there.

    Parameters
    ----------
    reduced : posterior with `priors`
    is_reference : whether each source is a reference source
    """
    prior_terms = _prior_terms(reduced, priors, is_reference)
    scaled = prior_terms.scaled(prior_terms.root)
    prior_share, axes = np.linalg.eigh(
        prior_terms.references + prior_terms.sources + scaled.T @ scaled
    )
    order = np.argsort(prior_share)[::-1]
    prior_share, axes = prior_share[order], axes[:, order]
    n_unconstrained = int((1.0 - prior_share < _UNCONSTRAINED).sum())
    information = np.diag(reduced.theta)
    if n_unconstrained:
        axes[:, :n_unconstrained] = _simple_axes(
            axes[:, :n_unconstrained], prior_terms, information, layout
        )
    return _eigenmodes(prior_terms.root @ axes, axes, prior_terms, information)


def _prior_terms(
    reduced: ReducedSystem, priors: Priors, is_reference: Bool[np.ndarray, " src"]
) -> _PriorTerms:
    order = reduced.source_blocks.order
    weight, is_reference = _prior_root(reduced, priors)[order], is_reference[order]
    grams = [np.zeros(reduced.factor.shape) for _ in range(2)]
    root = sl.solve_triangular(reduced.factor, np.eye(len(reduced.factor)))
    blocks = reduced.source_blocks.blocks

    def of_block(block: SourceBlock, matrix: np.ndarray) -> list[np.ndarray]:
        weighted, of_references = (
            _weighted(matrix, weight[block.places]),
            is_reference[block.places],
        )
        return [_gram(weighted[:, :, members]) for members in (of_references, ~of_references)]

    def whitened(gram: np.ndarray) -> np.ndarray:
        return upper_transposed_times(root, upper_transposed_times(root, gram).T)

    with one_blas_thread(), ThreadPoolExecutor(_WORKERS) as helpers:
        # Added in their order: the axes below depend on every rounding error.
        for block, found in zip(
            blocks, helpers.map(of_block, blocks, reduced.whitened), strict=True
        ):
            give_way()
            for gram, of_some in zip(grams, found, strict=True):
                gram[np.ix_(block.columns, block.columns)] += of_some
        references, sources = helpers.map(whitened, grams)
    return _PriorTerms(
        references, sources, root, lambda vectors: priors.scaled(vectors, reduced.at[0])
    )


def _prior_root(reduced: ReducedSystem, priors: Priors) -> Float[np.ndarray, "src 2 2"]:
    """Return H_i with Z_i H_i H_i' Z_i' = W_i (V_i^-1 - (V_i + Q_i)^-1) W_i'."""
    lower = np.linalg.inv(reduced.source_factor)
    share, axes = np.linalg.eigh(lower @ priors.precision @ lower.swapaxes(1, 2))
    data_share = 1.0 - share
    # A direction of a source without measurements does not constrain the calibration either.
    is_measured = data_share > _NEGLIGIBLE
    weight = np.where(is_measured, share, 0.0) / np.where(is_measured, data_share, 1.0)
    return axes * np.sqrt(np.maximum(weight, 0.0))[:, None, :]


def _weighted(
    rows: Float[np.ndarray, "calib 2 src"], root: Float[np.ndarray, "src 2 2"]
) -> Float[np.ndarray, "calib 2 src"]:
    weighted = np.empty(rows.shape)
    for a in range(2):
        np.multiply(rows[:, 0], root[:, 0, a], out=weighted[:, a])
        weighted[:, a] += rows[:, 1] * root[:, 1, a]
    return weighted


def _gram(rows: Float[np.ndarray, "calib 2 _"]) -> Float[np.ndarray, "calib calib"]:
    flat = rows.reshape(len(rows), -1)
    return flat @ flat.T


def _simple_axes(
    axes: Float[np.ndarray, "calib n"],
    prior_terms: _PriorTerms,
    information: Float[np.ndarray, " calib"],
    layout: VectorLayout,
) -> Float[np.ndarray, "calib n"]:
    """Rotate the axes of the unconstrained space to simple structure.

    Axes are first separated by the size of their parameters' moves, then concentrated on as few
    priors as possible, then, among axes of similar size, on few priors and few parameter groups.
    """
    vectors = prior_terms.root @ axes
    prior_grams = np.array(
        [
            axes.T @ prior_terms.references @ axes,
            axes.T @ prior_terms.sources @ axes,
            *_group_grams(prior_terms.scaled(vectors), layout),
        ]
    )
    group_grams = np.array(_group_grams(vectors * np.sqrt(information)[:, None], layout))
    rotation = np.linalg.eigh(group_grams.sum(axis=0))[1][:, ::-1]
    rotation = rotation @ joint_axes(rotation.T @ prior_grams @ rotation)
    size = np.diag(rotation.T @ group_grams.sum(axis=0) @ rotation)
    order = np.argsort(size)[::-1]
    rotation, size = rotation[:, order], size[order]
    for similar in np.split(np.arange(len(size)), 1 + np.flatnonzero(size[:-1] > _GAP * size[1:])):
        axes_of_set = rotation[:, similar]
        both = np.concatenate([prior_grams, group_grams / size[similar].mean()])
        rotation[:, similar] = axes_of_set @ joint_axes(axes_of_set.T @ both @ axes_of_set)
    size = np.diag(rotation.T @ group_grams.sum(axis=0) @ rotation)
    return axes @ rotation[:, np.argsort(size)[::-1]]


def _group_grams(
    vectors: Float[np.ndarray, "calib n"], layout: VectorLayout
) -> list[Float[np.ndarray, "n n"]]:
    by_group = (vectors[layout.columns(group)] for group in layout.groups)
    return [rows.T @ rows for rows in by_group]


def _eigenmodes(
    vectors: Float[np.ndarray, "calib calib"],
    axes: Float[np.ndarray, "calib calib"],
    prior_terms: _PriorTerms,
    information: Float[np.ndarray, " calib"],
) -> Eigenmodes:
    in_priors = prior_terms.scaled(vectors)

    def share(term: np.ndarray) -> np.ndarray:
        return np.einsum("ik,ik->k", axes, term @ axes)

    with one_blas_thread(), ThreadPoolExecutor(_WORKERS) as helpers:
        of_sources = helpers.map(share, (prior_terms.references, prior_terms.sources))
        prior_shares = np.stack([*of_sources, np.einsum("ik,ik->k", in_priors, in_priors)])
    data_share = np.maximum(1.0 - prior_shares.sum(axis=0), 0.0)
    # Exceeds one by the rounding errors of S.
    total = data_share + prior_shares.sum(axis=0)
    relative = total / (information @ vectors**2)
    references, sources, calibration = prior_shares / total
    return Eigenmodes(
        vectors / np.sqrt(total), data_share / total, references, sources, calibration, relative
    )
