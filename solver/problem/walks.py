"""Walks: distortion coefficients that change from exposure to exposure as random walks.

The prior of a random walk is independent not for its elements but for their mean and for the steps
from each exposure to the next one in time. The steps have the prior width of the group. The
mean belongs to the constant distortion, so that its width is negligible.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from solver.problem.parameter_vector import VectorLayout

# Prior width of the mean of a walk, um. The data allow a thousandth of a micrometre.
MEAN_WIDTH_UM = 1e-4


class Walks(NamedTuple):
    """The columns of each walk, in order of time.

    All methods take values by calibration parameter along their first axis. Without a walk they
    return the same object.
    """

    columns: Int[np.ndarray, "walk exp"]

    def independent(self, values: Float[np.ndarray, "calib ..."]) -> Float[np.ndarray, "calib ..."]:
        """Return values with mean and steps of each walk in place of its elements.

        The mean is at the first element. This change of variables has determinant one.
        """
        if not self.columns.size:
            return values
        found, of_walks = values.copy(), values[self.columns]
        found[self.columns[:, 0]] = of_walks.mean(axis=1)
        found[self.columns[:, 1:]] = np.diff(of_walks, axis=1)
        return found

    def transposed(self, values: Float[np.ndarray, " calib"]) -> Float[np.ndarray, " calib"]:
        """Return the product with the transposed matrix of `independent`."""
        if not self.columns.size:
            return values
        found, (_, n_exp) = values.copy(), self.columns.shape
        mean, steps = values[self.columns[:, :1]], values[self.columns[:, 1:]]
        total = np.repeat(mean / n_exp, n_exp, axis=1)
        total[:, 1:] += steps
        total[:, :-1] -= steps
        found[self.columns] = total
        return found

    def variances(
        self, covariance: Float[np.ndarray, "calib calib"]
    ) -> Float[np.ndarray, " calib"]:
        """Return the variances of the independent values, from the covariance of all."""
        found, matrix = np.diag(covariance), self._matrix()
        if not self.columns.size:
            return found
        found = found.copy()
        for columns in self.columns:
            found[columns] = np.diag(matrix @ covariance[np.ix_(columns, columns)] @ matrix.T)
        return found

    def hessian(self, diagonal: Float[np.ndarray, " calib"]) -> Float[np.ndarray, "walk exp exp"]:
        """Return the matrix of each walk's elements from a diagonal one of its mean and steps."""
        matrix = self._matrix()
        return matrix.T @ (diagonal[self.columns][:, :, None] * matrix)

    def sigmas(self, width: Float[np.ndarray, " calib"]) -> Float[np.ndarray, " calib"]:
        """Return the standard deviations of all values, from those of the independent ones."""
        if not self.columns.size:
            return width
        found, elements = width.copy(), np.linalg.inv(self._matrix())
        found[self.columns] = np.sqrt(width[self.columns] ** 2 @ elements.T**2)
        return found

    def with_widths_of_means(
        self, width: Float[np.ndarray, " calib"]
    ) -> Float[np.ndarray, " calib"]:
        """Return prior widths with that of the mean at the first element of each walk."""
        if not self.columns.size:
            return width
        found = width.copy()
        found[self.columns[:, 0]] = MEAN_WIDTH_UM
        return found

    def _matrix(self) -> Float[np.ndarray, "exp exp"]:
        """Return the matrix from the elements of a walk to its mean and steps."""
        n_exp = self.columns.shape[1]
        matrix = np.eye(n_exp) - np.eye(n_exp, k=-1)
        matrix[:1] = 1.0 / max(n_exp, 1)
        return matrix


NO_WALKS = Walks(np.empty((0, 0), dtype=np.int64))


def walks_of(layout: VectorLayout, time: Float[np.ndarray, " exp"]) -> Walks:
    """Return the walks of a fit.

    Parameters
    ----------
    time : of the exposures, in any unit
    """
    in_order = np.argsort(time, kind="stable")
    return Walks(layout.walked(in_order).T) if layout.n_walk else NO_WALKS
