"""Elimination of the sources: the reduced system, its step and its covariances.

With priors added, V_i = L_i L_i' and Z = W L'^-1, the calibration alone obeys
S = U - Z Z' (the Schur complement); its inverse is the marginal covariance of the
calibration, and that of source i is V_i^-1 + V_i^-1 W_i' S^-1 W_i V_i^-1. Z is stored as one
dense matrix per source block (`solver.problem.source_blocks`).
"""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import scipy.linalg as sl
from jaxtyping import Bool, Float

from solver.linear.normal_equations import NormalEquations
from solver.linear.triangular import lower_solve, rows_solved, upper_solve
from solver.problem.priors import Priors
from solver.problem.source_blocks import SourceBlock, SourceBlocks
from solver.runtime.threads import one_blas_thread

# Limits on the information along a direction, relative to that of its parameters taken alone:
# of weak directions, which only the priors constrain, and of poorly constrained ones.
_WEAK, POORLY_CONSTRAINED = 1e-6, 1e-3
# Maximum number of weak directions searched for.
_MAX_WEAK = 16
# More threads would be limited by memory bandwidth.
_WORKERS = 2


@dataclass(frozen=True)
class ReducedSystem:
    """The factorised posterior at one linearisation point.

    Attributes
    ----------
    at : linearisation point, calibration and sources
    theta : U with priors
    source_factor : lower Cholesky factor of V with priors
    source_blocks : blocks of the sources
    whitened : Z, one matrix per source block
    of_data : S without the calibration's priors
    factor : upper Cholesky factor R of S = R'R, with the priors
    """

    at: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]
    theta: Float[np.ndarray, "calib calib"]
    source_factor: Float[np.ndarray, "src 2 2"]
    source_blocks: SourceBlocks
    whitened: tuple[Float[np.ndarray, "_ 2 _"], ...]
    of_data: Float[np.ndarray, "calib calib"]
    factor: Float[np.ndarray, "calib calib"]

    def solve(
        self,
        by_theta: Float[np.ndarray, " calib"],
        by_source: Float[np.ndarray, "src 2"],
        fixed: Float[np.ndarray, "calib weak"] | None = None,
    ) -> tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]:
        """Solve the whole system for one right-hand side.

        Parameters
        ----------
        fixed : directions, as from `weak_directions`, along which the calibration is kept fixed
        """
        whitened = lower_solve(self.source_factor, by_source.T)
        by_calibration = self.onto_calibration(whitened[None])[0]
        theta = sl.cho_solve((self.factor, False), by_theta - by_calibration)
        if fixed is not None:
            theta = theta - fixed @ (fixed.T @ (np.diag(self.theta) * theta))
        remainder = whitened - self.onto_sources(theta[None])[0]
        return theta, upper_solve(self.source_factor, remainder).T.copy()

    def pulled(self, by_source: Float[np.ndarray, "k src 2"]) -> Float[np.ndarray, "k src 2"]:
        """Return the shifts of the sources for k right-hand sides on the sources only."""
        whitened = lower_solve(self.source_factor, by_source.swapaxes(1, 2))
        theta = sl.cho_solve((self.factor, False), -self.onto_calibration(whitened).T)
        remainder = whitened - self.onto_sources(theta.T)
        return upper_solve(self.source_factor, remainder).swapaxes(1, 2)

    def onto_calibration(
        self, whitened: Float[np.ndarray, "k 2 src"]
    ) -> Float[np.ndarray, "k calib"]:
        """Return Z x for k vectors over the sources."""
        ordered = whitened[:, :, self.source_blocks.order]
        found = np.zeros((len(whitened), len(self.factor)))
        for block, matrix in self._block_matrices():
            values = ordered[:, :, block.places].reshape(len(whitened), -1)
            found[:, block.columns] += values @ matrix.reshape(len(matrix), -1).T
        return found

    def onto_sources(self, theta: Float[np.ndarray, "k calib"]) -> Float[np.ndarray, "k 2 src"]:
        """Return Z' x for k vectors over the calibration."""
        found = np.empty((len(theta), 2, len(self.source_factor)))
        for block, matrix in self._block_matrices():
            product = theta[:, block.columns] @ matrix.reshape(len(matrix), -1)
            found[:, :, block.places] = product.reshape(len(theta), *matrix.shape[1:])
        return found[:, :, self.source_blocks.position]

    def _block_matrices(self) -> Iterator[tuple[SourceBlock, Float[np.ndarray, "_ 2 _"]]]:
        return zip(self.source_blocks.blocks, self.whitened, strict=True)

    @cached_property
    def sigmas(self) -> tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]:
        """Marginal sigmas of the calibration, and conditional ones of the sources, mas."""
        inverse, _ = sl.lapack.dtrtri(self.factor)
        of_sources = np.diagonal(self.conditional_covariance(), axis1=1, axis2=2)
        return np.sqrt(np.einsum("ij,ij->i", inverse, inverse)), np.sqrt(of_sources)

    def conditional_covariance(self) -> Float[np.ndarray, "src 2 2"]:
        """Return the covariance of each source with the calibration fixed, mas^2."""
        unit = np.broadcast_to(np.eye(2)[:, :, None], (2, 2, len(self.source_factor)))
        inverse = lower_solve(self.source_factor, unit)
        return np.einsum("ias,ibs->sab", inverse.swapaxes(0, 1), inverse.swapaxes(0, 1))

    def response(self) -> Float[np.ndarray, "calib 2 src"]:
        """Return W V^-1, in block order: minus the shift of each source per unit of calibration."""
        return upper_solve(self.source_factor[self.source_blocks.order], self._dense())

    def of_whitened(self, whitened: Float[np.ndarray, "*k 2 src"]) -> Float[np.ndarray, "*k 2 src"]:
        """Return L_i'^-1 x_i: whitened source vectors converted to mas."""
        return upper_solve(self.source_factor, whitened)

    def source_shifts(self, vectors: Float[np.ndarray, "calib k"]) -> Float[np.ndarray, "k 2 src"]:
        """Return -V_i^-1 W_i' v: shift (alpha*, delta) of each source for each vector, mas."""
        return -self.of_whitened(self.onto_sources(vectors.T))

    def spread(
        self, members: Bool[np.ndarray, " src"] | None = None
    ) -> Float[np.ndarray, "calib 2 _"]:
        """Return T = R'^-1 Z of all sources, or of some, in block order.

        I + T_i' T_i is the whitened marginal covariance of source i.
        """
        return rows_solved(self.factor, self._dense(members), trans=True)

    def _dense(
        self, members: Bool[np.ndarray, " src"] | None = None
    ) -> Float[np.ndarray, "calib 2 _"]:
        """Return Z of all sources, or of some, in block order."""
        order, first = self.source_blocks.order, 0
        chosen = np.ones(len(order), dtype=bool) if members is None else members[order]
        dense = np.zeros((len(self.factor), 2, chosen.sum()))
        for block, matrix in self._block_matrices():
            inside = chosen[block.places]
            part = matrix if inside.all() else matrix[:, :, inside]
            dense[block.columns, :, first : first + part.shape[-1]] = part
            first += part.shape[-1]
        return dense

    def weak_directions(self, below: float = _WEAK) -> Float[np.ndarray, "calib weak"]:
        """Return the directions of the calibration that only the priors constrain.

        They are eigenvectors of the reduced system, each parameter in units of its
        conditional sigma, with eigenvalues near zero: common changes of pointings, roll and
        focal lengths and of the places, rotations and pitches of the detectors.

        Parameters
        ----------
        below : limit of the eigenvalues; larger than the default for poorly constrained directions
        """
        scale = 1.0 / np.sqrt(np.diag(self.theta))
        block = np.random.default_rng(0).standard_normal((len(scale), min(_MAX_WEAK, len(scale))))
        # Two inverse iterations suffice, because the gap to the other eigenvalues is wide.
        for _ in range(2):
            block = sl.cho_solve((self.factor, False), block / scale[:, None]) / scale[:, None]
            block = np.linalg.qr(block)[0]
        image = self.factor @ (scale[:, None] * block)
        values, vectors = np.linalg.eigh(image.T @ image)
        return scale[:, None] * (block @ vectors[:, values < below])

    def theta_covariance(self) -> Float[np.ndarray, "calib calib"]:
        """Return the marginal covariance of the calibration."""
        return sl.cho_solve((self.factor, False), np.eye(len(self.factor)))

    def log_determinant(self) -> float:
        """Return the logarithm of the determinant of the full Hessian."""
        of_sources = np.log(self.source_factor[:, [0, 1], [0, 1]]).sum()
        return float(2.0 * (of_sources + np.log(np.diag(self.factor)).sum()))


def eliminate_sources(
    equations: NormalEquations, priors: Priors, before: ReducedSystem | None = None
) -> ReducedSystem | None:
    """Add the priors, eliminate the sources and factorise.

    Parameters
    ----------
    before : reduced system of the same equations under other priors; its costly terms are
        reused if the priors of the sources are the same

    Returns
    -------
    None if the system is singular: the data and the priors leave a direction unconstrained, or
    constrain it so weakly that rounding hides it.
    """
    theta = equations.at[0]
    try:
        source_factor = np.linalg.cholesky(equations.source + priors.precision)
        if before is not None and np.array_equal(before.source_factor, source_factor):
            whitened, of_data = before.whitened, before.of_data
        else:
            whitened, of_data = _without_sources(equations, source_factor)
        # NumPy's BLAS, as for the products above, because SciPy's threads would wait for it.
        factor = np.linalg.cholesky(priors.with_hessian(of_data, theta)).T
    except np.linalg.LinAlgError:
        return None
    hessian = priors.with_hessian(equations.theta, theta)
    # A squared pivot is what remains of the diagonal after eliminating the other parameters.
    smallest = len(hessian) * np.finfo(float).eps * np.diag(hessian)
    if not (np.diag(factor) ** 2 >= smallest).all():
        return None
    return ReducedSystem(
        equations.at,
        hessian,
        source_factor,
        equations.source_blocks,
        whitened,
        of_data,
        factor,
    )


def _without_sources(
    equations: NormalEquations, source_factor: Float[np.ndarray, "src 2 2"]
) -> tuple[tuple[Float[np.ndarray, "_ 2 _"], ...], Float[np.ndarray, "calib calib"]]:
    """Return the matrix of Z of each source block, and U - Z Z' without priors."""
    blocks, remaining = equations.source_blocks.blocks, equations.theta.copy()
    ordered = source_factor[equations.source_blocks.order]
    # Blocks side by side: BLAS threads would wait for one another in a busy loop.
    with one_blas_thread(), ThreadPoolExecutor(max_workers=_WORKERS) as helpers:
        parts = list(helpers.map(partial(_of_block, equations, ordered), blocks))
    for block, (_, product) in zip(blocks, parts, strict=True):
        remaining[np.ix_(block.columns, block.columns)] -= product
    return tuple(matrix for matrix, _ in parts), remaining


def _of_block(
    equations: NormalEquations, source_factor: Float[np.ndarray, "src 2 2"], block: SourceBlock
) -> tuple[Float[np.ndarray, "_ 2 _"], Float[np.ndarray, "_ _"]]:
    """Return Z of a source block, and its part of Z Z'.

    Parameters
    ----------
    source_factor : L of each source, in block order
    """
    cross = equations.cross[block.columns, :, block.places]
    matrix = lower_solve(source_factor[block.places], cross)
    rows = matrix.reshape(len(matrix), -1)
    return matrix, rows @ rows.T
