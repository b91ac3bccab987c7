"""Elimination of the sources: the reduced system, its step and its covariances.

With priors added, V_i = L_i L_i' and Z = W L'^-1, the calibration alone obeys
S = U - Z Z' (the Schur complement); its inverse is the marginal covariance of the
calibration, and that of source i is V_i^-1 + V_i^-1 W_i' S^-1 W_i V_i^-1.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float

from solver.normal import NormalEquations
from solver.priors import Priors

# Directions with less than this share of the information that their parameters have alone are
# held by the priors only; and those with less than that are held poorly.
_WEAK, POORLY_HELD = 1e-6, 1e-3
# At most so many of them are looked for.
_BLOCK = 16


@dataclass(frozen=True)
class Reduced:
    """The factorised posterior at one linearisation point.

    Attributes
    ----------
    at : where the model was linearised, calibration and sources
    theta : U with priors
    source_factor : lower Cholesky factor of V with priors
    whitened : Z
    of_data : S without the calibration's priors
    factor : upper Cholesky factor R of S = R'R
    """

    at: tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]
    theta: Float[np.ndarray, "calib calib"]
    source_factor: Float[np.ndarray, "src 2 2"]
    whitened: Float[np.ndarray, "calib 2 src"]
    of_data: Float[np.ndarray, "calib calib"]
    factor: Float[np.ndarray, "calib calib"]

    def solve(
        self,
        by_theta: Float[np.ndarray, " calib"],
        by_source: Float[np.ndarray, "src 2"],
        held: Float[np.ndarray, "calib weak"] | None = None,
    ) -> tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]:
        """Solve the whole system for one right-hand side.

        Parameters
        ----------
        held : directions, as from `weak_directions`, in which the calibration does not move
        """
        whitened = _lower_solve(self.source_factor, by_source.T)
        rows = self.whitened.reshape(len(by_theta), -1)
        theta = sl.cho_solve((self.factor, False), by_theta - rows @ whitened.ravel())
        if held is not None:
            theta = theta - held @ (held.T @ (np.diag(self.theta) * theta))
        remainder = whitened - (theta @ rows).reshape(whitened.shape)
        return theta, _upper_solve(self.source_factor, remainder).T.copy()

    def pulled(self, by_source: Float[np.ndarray, "k src 2"]) -> Float[np.ndarray, "k src 2"]:
        """Return the shifts of the sources that pulls on them alone cause, for k sets of pulls."""
        whitened = _lower_solve(self.source_factor, by_source.swapaxes(1, 2))
        rows, n_sets = self.whitened.reshape(len(self.factor), -1), len(by_source)
        theta = sl.cho_solve((self.factor, False), -rows @ whitened.reshape(n_sets, -1).T)
        remainder = whitened - (theta.T @ rows).reshape(whitened.shape)
        return _upper_solve(self.source_factor, remainder).swapaxes(1, 2)

    @cached_property
    def sigmas(self) -> tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]:
        """Marginal sigmas of the calibration, and conditional ones of the sources, mas."""
        inverse, _ = sl.lapack.dtrtri(self.factor)
        of_sources = np.diagonal(self.conditional_covariance(), axis1=1, axis2=2)
        return np.sqrt(np.einsum("ij,ij->i", inverse, inverse)), np.sqrt(of_sources)

    def conditional_covariance(self) -> Float[np.ndarray, "src 2 2"]:
        """Return the covariance of each source with the calibration held fixed, mas^2."""
        unit = np.broadcast_to(np.eye(2)[:, :, None], (2, 2, len(self.source_factor)))
        inverse = _lower_solve(self.source_factor, unit)
        return np.einsum("ias,ibs->sab", inverse.swapaxes(0, 1), inverse.swapaxes(0, 1))

    def response(self) -> Float[np.ndarray, "calib 2 src"]:
        """Return W V^-1, minus the shift of each source per unit of the calibration."""
        return _upper_solve(self.source_factor, self.whitened)

    def of_whitened(self, whitened: Float[np.ndarray, "*k 2 src"]) -> Float[np.ndarray, "*k 2 src"]:
        """Return L_i'^-1 x_i: what stands in units of the sources' own sigmas, in mas."""
        return _upper_solve(self.source_factor, whitened)

    def spread(self) -> Float[np.ndarray, "calib 2 src"]:
        """Return T = R'^-1 Z; I + T_i' T_i is the whitened marginal covariance of source i."""
        return self._solved(self.whitened, trans=True)

    def marginal_covariance(
        self, spread: Float[np.ndarray, "calib 2 src"]
    ) -> Float[np.ndarray, "src 2 2"]:
        """Return the covariance of each source with the calibration integrated out, mas^2."""
        inner = np.empty((2, 2, spread.shape[-1]))
        for a, b in ((0, 0), (0, 1), (1, 1)):
            inner[a, b] = np.einsum("ks,ks->s", spread[:, a], spread[:, b]) + (a == b)
        inner[1, 0] = inner[0, 1]
        half = _upper_solve(self.source_factor, inner)
        return _upper_solve(self.source_factor, half.swapaxes(0, 1)).transpose(2, 1, 0).copy()

    def weak_directions(self, below: float = _WEAK) -> Float[np.ndarray, "calib weak"]:
        """Return the directions of the calibration that only the priors hold.

        They are eigenvectors of the reduced system, each parameter in units of its
        conditional sigma, whose eigenvalue all but vanishes: what pointings, roll and focal
        lengths have in common with the places, rotations and pitches of the detectors.

        Parameters
        ----------
        below : the eigenvalue; with more than the default, poorly held directions are among them
        """
        scale = 1.0 / np.sqrt(np.diag(self.theta))
        block = np.random.default_rng(0).standard_normal((len(scale), min(_BLOCK, len(scale))))
        # So wide is the gap to the other eigenvalues that two inverse iterations do.
        for _ in range(2):
            block = sl.cho_solve((self.factor, False), block / scale[:, None]) / scale[:, None]
            block = np.linalg.qr(block)[0]
        image = self.factor @ (scale[:, None] * block)
        values, vectors = np.linalg.eigh(image.T @ image)
        return scale[:, None] * (block @ vectors[:, values < below])

    def theta_covariance(self) -> Float[np.ndarray, "calib calib"]:
        """Return the marginal covariance of the calibration."""
        return sl.cho_solve((self.factor, False), np.eye(len(self.factor)))

    def cross_covariance(
        self, spread: Float[np.ndarray, "calib 2 src"]
    ) -> Float[np.ndarray, "calib 2 src"]:
        """Return the covariance of the calibration with each source, -S^-1 W V^-1."""
        return _upper_solve(self.source_factor, self._solved(spread, trans=False, scale=-1.0))

    def _solved(
        self, right: Float[np.ndarray, "calib 2 src"], trans: bool, scale: float = 1.0
    ) -> Float[np.ndarray, "calib 2 src"]:
        """Return scale R^-1 (or R'^-1) times the rows."""
        rows = right.reshape(len(self.factor), -1)
        # Solved from the right, in place of its transpose: so BLAS has them in its own order.
        solved = sl.blas.dtrsm(scale, self.factor, rows.T, trans_a=not trans, side=1)
        return solved.T.reshape(right.shape)

    def log_determinant(self) -> float:
        """Return the logarithm of the determinant of the whole Hessian."""
        of_sources = np.log(self.source_factor[:, [0, 1], [0, 1]]).sum()
        return float(2.0 * (of_sources + np.log(np.diag(self.factor)).sum()))


def reduce(
    equations: NormalEquations, priors: Priors, before: Reduced | None = None
) -> Reduced | None:
    """Add the priors, eliminate the sources and factorise.

    Parameters
    ----------
    before : of the same equations under other priors. If those of the sources are the same, so
        is all that is costly.

    Returns
    -------
    None if the system is singular: the data and the priors leave a direction open, or hold
    it so weakly that rounding hides it.
    """
    curvature = priors.curvature(equations.at[0])
    try:
        source_factor = np.linalg.cholesky(equations.source + priors.precision)
        if before is not None and np.array_equal(before.source_factor, source_factor):
            whitened, of_data = before.whitened, before.of_data
        else:
            whitened = _lower_solve(source_factor, equations.cross)
            rows = whitened.reshape(len(curvature), -1)
            of_data = equations.theta - rows @ rows.T
        # NumPy's, like the product before it: SciPy has a BLAS of its own, whose threads would
        # wait for those of NumPy's, which go on spinning for a while.
        factor = np.linalg.cholesky(_with_diagonal(of_data, curvature)).T
    except np.linalg.LinAlgError:
        return None
    hessian = _with_diagonal(equations.theta, curvature)
    # A pivot is what is left of the diagonal once all else is accounted for.
    smallest = len(hessian) * np.finfo(float).eps * np.diag(hessian)
    if not (np.diag(factor) ** 2 >= smallest).all():
        return None
    return Reduced(equations.at, hessian, source_factor, whitened, of_data, factor)


def _with_diagonal(
    matrix: Float[np.ndarray, "n n"], added: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "n n"]:
    """Return the matrix with something added to its diagonal."""
    total = matrix.copy()
    total[np.diag_indices(len(added))] += added
    return total


def _lower_solve(
    factor: Float[np.ndarray, "src 2 2"], right: Float[np.ndarray, "*k 2 src"]
) -> Float[np.ndarray, "*k 2 src"]:
    """Solve L x = right for 2 x 2 lower triangles."""
    solved, (first, below, second) = np.empty(right.shape), _triangle(factor)
    np.divide(right[..., 0, :], first, out=solved[..., 0, :])
    np.multiply(solved[..., 0, :], -below, out=solved[..., 1, :])
    solved[..., 1, :] += right[..., 1, :]
    solved[..., 1, :] /= second
    return solved


def _upper_solve(
    factor: Float[np.ndarray, "src 2 2"], right: Float[np.ndarray, "*k 2 src"]
) -> Float[np.ndarray, "*k 2 src"]:
    """Solve L' x = right for 2 x 2 lower triangles L."""
    solved, (first, below, second) = np.empty(right.shape), _triangle(factor)
    np.divide(right[..., 1, :], second, out=solved[..., 1, :])
    np.multiply(solved[..., 1, :], -below, out=solved[..., 0, :])
    solved[..., 0, :] += right[..., 0, :]
    solved[..., 0, :] /= first
    return solved


def _triangle(factor: Float[np.ndarray, "src 2 2"]) -> Float[np.ndarray, "3 src"]:
    """Return the triangles' entries, each contiguous: loops over rows are then twice as fast."""
    return np.stack([factor[:, 0, 0], factor[:, 1, 0], factor[:, 1, 1]])
