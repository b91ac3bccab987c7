"""The eigen-spectrum of the calibration: which combinations of parameters the data decide.

The reduced matrix S = U + P - sum_i W_i V_i^-1 W_i' is a sum of what the measurements alone
say, of the calibration's priors P, and of what each source's prior Q_i adds: with the data's
V_i, W_i (V_i^-1 - (V_i + Q_i)^-1) W_i'. So along a combination v with v'Sv = 1 the shares of
measurements, reference sources, other sources and every prior are numbers that add up to one,
in whatever order they are attributed.

A *mode* is an eigenvector of S_data v = lambda S v, lambda being the share of the measurements.
Where lambda all but vanishes, eigenvectors are arbitrary axes of the space that the
measurements leave open; there the modes are the axes of simple structure.
"""

from typing import NamedTuple

import numpy as np
import scipy.linalg as sl
from jaxtyping import Bool, Float

from solver.data.parameters import CALIBRATION_GROUPS
from solver.linear.source_elimination import ReducedSystem
from solver.problem.parameter_vector import VectorLayout
from solver.problem.priors import Priors
from solver.results.simple_structure import joint_axes

WEAK = 0.5
"""Share of the measurements below which a mode is weak."""
MOST_WEAK = 12
"""At most so many weak modes are told in full."""
# Share of the measurements below which they are said to leave a combination open.
_OPEN = 1e-3
# Modes are only mixed with those whose relative information is within this factor.
_GAP = 10.0
# Share of a source's own data below which they say nothing of one of its directions.
_NOTHING = 1e-12


class Eigenmodes(NamedTuple):
    """All modes, those that the measurements leave open first.

    Attributes
    ----------
    vectors : modes as columns, each as far as one standard deviation of the posterior goes
    data : share of what is known of the mode that comes from the measurements, lambda
    references, sources : shares of the priors of reference sources and of all others
    calibration : share of the calibration's priors
    relative : v'Sv over the sum of v_j^2 / (conditional variance of j): what is known of
        the mode, relative to what its parameters would have if all else were held fixed
    """

    vectors: Float[np.ndarray, "calib calib"]
    data: Float[np.ndarray, " calib"]
    references: Float[np.ndarray, " calib"]
    sources: Float[np.ndarray, " calib"]
    calibration: Float[np.ndarray, " calib"]
    relative: Float[np.ndarray, " calib"]

    @property
    def n_weak(self) -> int:
        """Number of modes of which the measurements decide less than half."""
        return int((self.data < WEAK).sum())


class _Parts(NamedTuple):
    """S^-1/2 (matrix) S^-1/2' of the parts of S that are priors, and R^-1 with S = R'R."""

    references: Float[np.ndarray, "calib calib"]
    sources: Float[np.ndarray, "calib calib"]
    root: Float[np.ndarray, "calib calib"]


def find_eigenmodes(
    reduced: ReducedSystem,
    priors: Priors,
    layout: VectorLayout,
    is_reference: Bool[np.ndarray, " src"],
) -> Eigenmodes:
    """Return the modes of a factorised posterior.

    Rounding of S, in whose weakest directions all but 1e-11 of the information of single
    parameters cancels, hides shares of the measurements below about 1e-3 there.

    Parameters
    ----------
    reduced : made with `priors`
    is_reference : of each source
    """
    prior_hessian = priors.hessian_diagonal(reduced.at[0])
    parts = _prior_parts(reduced, priors, is_reference)
    scaled = parts.root * np.sqrt(prior_hessian)[:, None]
    decided, axes = np.linalg.eigh(parts.references + parts.sources + scaled.T @ scaled)
    order = np.argsort(decided)[::-1]
    decided, axes = decided[order], axes[:, order]
    n_open = int((1.0 - decided < _OPEN).sum())
    information = np.diag(reduced.theta)
    if n_open:
        axes[:, :n_open] = _open_axes(axes[:, :n_open], parts, prior_hessian, information, layout)
    return _described(parts.root @ axes, axes, parts, prior_hessian, information)


def _prior_parts(
    reduced: ReducedSystem, priors: Priors, is_reference: Bool[np.ndarray, " src"]
) -> _Parts:
    rows, order = reduced.spread(), reduced.source_blocks.order
    weighted = _weighted(rows, _prior_root(reduced, priors)[order])
    is_reference = is_reference[order]
    of_references = _gram(weighted[:, :, is_reference])
    weighted[:, :, is_reference] = 0.0
    root = sl.solve_triangular(reduced.factor, np.eye(len(rows)))
    return _Parts(of_references, _gram(weighted), root)


def _prior_root(reduced: ReducedSystem, priors: Priors) -> Float[np.ndarray, "src 2 2"]:
    """Return H_i with Z_i H_i H_i' Z_i' = W_i (V_i^-1 - (V_i + Q_i)^-1) W_i'."""
    lower = np.linalg.inv(reduced.source_factor)
    share, axes = np.linalg.eigh(lower @ priors.precision @ lower.swapaxes(1, 2))
    of_data = 1.0 - share
    # A direction of a source that no measurement sees is of no use to the calibration either.
    seen = of_data > _NOTHING
    weight = np.where(seen, share, 0.0) / np.where(seen, of_data, 1.0)
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


def _open_axes(
    axes: Float[np.ndarray, "calib n"],
    parts: _Parts,
    prior_hessian: Float[np.ndarray, " calib"],
    information: Float[np.ndarray, " calib"],
    layout: VectorLayout,
) -> Float[np.ndarray, "calib n"]:
    """Turn the axes of the open space until each has few deciders and few groups.

    First those are split off whose parameters move by orders of magnitude more than those of
    others, then as few priors as can be decide each, then as few groups as can be take part.
    """
    vectors = parts.root @ axes
    deciders = np.array(
        [
            axes.T @ parts.references @ axes,
            axes.T @ parts.sources @ axes,
            *_group_grams(vectors * np.sqrt(prior_hessian)[:, None], layout),
        ]
    )
    members = np.array(_group_grams(vectors * np.sqrt(information)[:, None], layout))
    turn = np.linalg.eigh(members.sum(axis=0))[1][:, ::-1]
    turn = turn @ joint_axes(turn.T @ deciders @ turn)
    size = np.diag(turn.T @ members.sum(axis=0) @ turn)
    order = np.argsort(size)[::-1]
    turn, size = turn[:, order], size[order]
    for alike in np.split(np.arange(len(size)), 1 + np.flatnonzero(size[:-1] > _GAP * size[1:])):
        part = turn[:, alike]
        both = np.concatenate([deciders, members / size[alike].mean()])
        turn[:, alike] = part @ joint_axes(part.T @ both @ part)
    size = np.diag(turn.T @ members.sum(axis=0) @ turn)
    return axes @ turn[:, np.argsort(size)[::-1]]


def _group_grams(
    vectors: Float[np.ndarray, "calib n"], layout: VectorLayout
) -> list[Float[np.ndarray, "n n"]]:
    parts = (vectors[layout.columns(group)] for group in CALIBRATION_GROUPS)
    return [part.T @ part for part in parts]


def _described(
    vectors: Float[np.ndarray, "calib calib"],
    axes: Float[np.ndarray, "calib calib"],
    parts: _Parts,
    prior_hessian: Float[np.ndarray, " calib"],
    information: Float[np.ndarray, " calib"],
) -> Eigenmodes:
    of_priors = np.stack(
        [
            np.einsum("ik,ik->k", axes, parts.references @ axes),
            np.einsum("ik,ik->k", axes, parts.sources @ axes),
            prior_hessian @ vectors**2,
        ]
    )
    of_data = np.maximum(1.0 - of_priors.sum(axis=0), 0.0)
    # More than all by what S lost to rounding.
    known = of_data + of_priors.sum(axis=0)
    relative = known / (information @ vectors**2)
    references, sources, calibration = of_priors / known
    return Eigenmodes(
        vectors / np.sqrt(known), of_data / known, references, sources, calibration, relative
    )
