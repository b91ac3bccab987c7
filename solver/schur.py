"""Elimination of the sources: the reduced system, its step and its covariances.

With priors added, V_i = L_i L_i' and Z = L^-1 W, the calibration alone obeys
S = U - Z'Z (the Schur complement); its inverse is the marginal covariance of the
calibration, and that of source i is V_i^-1 + V_i^-1 W_i S^-1 W_i' V_i^-1.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float

from solver.normal import NormalEquations
from solver.priors import Priors


@dataclass(frozen=True)
class Reduced:
    """The factorised posterior at one linearisation point.

    Attributes
    ----------
    by_theta, by_source : minus the gradient of half the posterior's chi2
    theta : U with priors
    source_factor : lower Cholesky factor of V with priors
    whitened : Z
    factor : upper Cholesky factor R of S = R'R
    """

    by_theta: Float[np.ndarray, " calib"]
    by_source: Float[np.ndarray, "src 2"]
    theta: Float[np.ndarray, "calib calib"]
    source_factor: Float[np.ndarray, "src 2 2"]
    whitened: Float[np.ndarray, "src 2 calib"]
    factor: Float[np.ndarray, "calib calib"]

    def step(self) -> tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]:
        """Return the Newton step of the calibration and of the sources."""
        return self.solve(self.by_theta, self.by_source)

    def solve(
        self, by_theta: Float[np.ndarray, " calib"], by_source: Float[np.ndarray, "src 2"]
    ) -> tuple[Float[np.ndarray, " calib"], Float[np.ndarray, "src 2"]]:
        """Solve the whole system for one right-hand side."""
        whitened = _lower_solve(self.source_factor, by_source[..., None])[..., 0]
        reduced = by_theta - np.einsum("sak,sa->k", self.whitened, whitened)
        theta = sl.cho_solve((self.factor, False), reduced)
        remainder = whitened - self.whitened @ theta
        return theta, _upper_solve(self.source_factor, remainder[..., None])[..., 0]

    def conditional_covariance(self) -> Float[np.ndarray, "src 2 2"]:
        """Return the covariance of each source with the calibration held fixed, mas^2."""
        inverse = _lower_solve(
            self.source_factor, np.broadcast_to(np.eye(2), self.source_factor.shape)
        )
        return np.swapaxes(inverse, 1, 2) @ inverse

    def response(self) -> Float[np.ndarray, "src 2 calib"]:
        """Return V^-1 W, minus the shift of each source per unit of the calibration."""
        return _upper_solve(self.source_factor, self.whitened)

    def spread(self) -> Float[np.ndarray, "src 2 calib"]:
        """Return T = Z R^-1; I + T_i T_i' is the whitened marginal covariance of source i."""
        rows = self.whitened.reshape(-1, len(self.factor))
        # Solved in place of its transpose: BLAS then works on the rows as they lie in memory.
        solved = sl.blas.dtrsm(1.0, self.factor, rows.T, trans_a=1, side=0)
        return np.ascontiguousarray(solved.T).reshape(self.whitened.shape)

    def marginal_covariance(
        self, spread: Float[np.ndarray, "src 2 calib"]
    ) -> Float[np.ndarray, "src 2 2"]:
        """Return the covariance of each source with the calibration integrated out, mas^2."""
        inner = np.eye(2) + spread @ np.swapaxes(spread, 1, 2)
        half = _upper_solve(self.source_factor, inner)
        return _upper_solve(self.source_factor, np.swapaxes(half, 1, 2))

    def theta_covariance(self) -> Float[np.ndarray, "calib calib"]:
        """Return the marginal covariance of the calibration."""
        return sl.cho_solve((self.factor, False), np.eye(len(self.factor)))

    def cross_covariance(
        self, spread: Float[np.ndarray, "src 2 calib"]
    ) -> Float[np.ndarray, "src 2 calib"]:
        """Return the covariance of each source with the calibration, -V^-1 W S^-1."""
        rows = spread.reshape(-1, len(self.factor))
        solved = sl.blas.dtrsm(-1.0, self.factor, rows.T, trans_a=0, side=0)
        solved = np.ascontiguousarray(solved.T).reshape(spread.shape)
        return _upper_solve(self.source_factor, solved)

    def log_determinant(self) -> float:
        """Return the logarithm of the determinant of the whole Hessian."""
        of_sources = np.log(self.source_factor[:, [0, 1], [0, 1]]).sum()
        return float(2.0 * (of_sources + np.log(np.diag(self.factor)).sum()))


def reduce(
    equations: NormalEquations,
    priors: Priors,
    theta: Float[np.ndarray, " calib"],
    sources: Float[np.ndarray, "src 2"],
) -> Reduced | None:
    """Add the priors at (theta, sources), eliminate the sources and factorise.

    Returns
    -------
    None if the system is singular: the data and the priors leave a direction open, or hold
    it so weakly that rounding hides it.
    """
    diagonal = np.diag(equations.theta) + priors.curvature(theta)
    hessian = equations.theta.copy()
    np.fill_diagonal(hessian, diagonal)
    source = equations.source + priors.precision
    try:
        source_factor = np.linalg.cholesky(source)
        whitened = _lower_solve(source_factor, equations.cross)
        rows = whitened.reshape(-1, len(hessian))
        factor = sl.cholesky(hessian - rows.T @ rows, check_finite=True)
    except (np.linalg.LinAlgError, ValueError):
        return None
    # A pivot is what is left of the diagonal once all else is accounted for.
    if (np.diag(factor) ** 2 < len(hessian) * np.finfo(float).eps * diagonal).any():
        return None
    return Reduced(
        by_theta=equations.by_theta - priors.gradient(theta),
        by_source=equations.by_source - np.einsum("sij,sj->si", priors.precision, sources),
        theta=hessian,
        source_factor=source_factor,
        whitened=whitened,
        factor=factor,
    )


def _lower_solve(
    factor: Float[np.ndarray, "src 2 2"], right: Float[np.ndarray, "src 2 k"]
) -> Float[np.ndarray, "src 2 k"]:
    """Solve L x = right for 2 x 2 lower triangles."""
    solved = np.empty_like(right, order="C")
    np.divide(right[:, 0], factor[:, 0, 0, None], out=solved[:, 0])
    np.multiply(solved[:, 0], -factor[:, 1, 0, None], out=solved[:, 1])
    solved[:, 1] += right[:, 1]
    solved[:, 1] /= factor[:, 1, 1, None]
    return solved


def _upper_solve(
    factor: Float[np.ndarray, "src 2 2"], right: Float[np.ndarray, "src 2 k"]
) -> Float[np.ndarray, "src 2 k"]:
    """Solve L' x = right for 2 x 2 lower triangles L."""
    solved = np.empty_like(right, order="C")
    np.divide(right[:, 1], factor[:, 1, 1, None], out=solved[:, 1])
    np.multiply(solved[:, 1], -factor[:, 1, 0, None], out=solved[:, 0])
    solved[:, 0] += right[:, 0]
    solved[:, 0] /= factor[:, 0, 0, None]
    return solved
