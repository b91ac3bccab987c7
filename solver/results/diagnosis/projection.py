"""What the fit leaves of patterns in the residuals: their products and the covariance of these.

With the patterns P, the weights W, and the columns J of all that is fitted, the residuals of a
good solution make the products P'Wr normal, with mean zero and the covariance

    V = P'WP - P'WJ (J'WJ + prior)^-1 J'WP,

and a displacement by P times a adds V a to them: V^-1 P'Wr is what a fit with these patterns
would find, and r'WP V^-1 P'Wr what it would take from chi2. J is built anew here, on the focal
plane and for isotropic errors, so that a stored result can be tested. V takes a sample of the
sources, scaled up; the products take all.
"""

from functools import reduce
from typing import NamedTuple

import numpy as np
from scipy import linalg

from solver.data.result import FitResult
from solver.results.diagnosis.columns import columns_at, order_of
from solver.results.diagnosis.fitted import (
    absorbed_by_positions,
    precision_of,
    shared_columns,
    with_exposures,
)
from solver.results.diagnosis.patterns import Family, Patterns
from solver.results.diagnosis.rows import Camera, Rows
from solver.results.diagnosis.sample import sample_of

# Directions of which the fit leaves less than this share are not tested.
_LEAST_LEFT = 0.02


class Evidence(NamedTuple):
    """What the residuals say of a family of patterns.

    Attributes
    ----------
    chi2 : how much chi2 would fall if the patterns were fitted
    dof : of chi2 if the solution is good; without the directions that the fit absorbs
    amplitude : of each column of the patterns, um; what a fit would find
    size : root of the mean squared displacement, both axes, um
    """

    chi2: float
    dof: int
    amplitude: np.ndarray
    size: float


class Projection(NamedTuple):
    """The products of the patterns with the residuals, and their covariance.

    Attributes
    ----------
    products : um^-1, shape (columns,)
    total, left : covariance before and after the fit, um^-2, shape (columns, columns)
    weight : of all measurements, um^-2
    """

    products: np.ndarray
    total: np.ndarray
    left: np.ndarray
    weight: float

    def evidence(self, family: Family) -> Evidence:
        """Return what the residuals say of a family."""
        square, weights = np.ix_(family.columns, family.columns), family.weights
        products, total, left = self.products[family.columns], self.total[square], self.left[square]
        if weights is not None:
            products = weights.T @ products
            total, left = (weights.T @ of_columns @ weights for of_columns in (total, left))
        # In directions in which the patterns are independent before the fit.
        values, vectors = _eigenvectors(total)
        whole = values > 1e-9 * values[-1]
        scaled = vectors[:, whole] / np.sqrt(values[whole])
        shares, turned = np.linalg.eigh(scaled.T @ left @ scaled)
        is_left = shares > _LEAST_LEFT
        basis = scaled @ turned[:, is_left]
        along = basis.T @ products
        found = basis @ (along / shares[is_left])
        chi2 = float(np.sum(along**2 / shares[is_left]))
        size = float(np.sqrt(max(found @ total @ found, 0.0) / max(self.weight, 1e-300)))
        amplitude = found if weights is None else weights @ found
        return Evidence(chi2, int(is_left.sum()), amplitude, size)

    def without(self, family: Family) -> "Projection":
        """Return the projection after the patterns of a family are fitted, too."""
        weights = np.eye(len(family.columns)) if family.weights is None else family.weights
        cross = self.left[:, family.columns] @ weights
        own = weights.T @ self.left[np.ix_(family.columns, family.columns)] @ weights
        inverse = linalg.pinvh(own, rtol=1e-6)
        products = self.products - cross @ (inverse @ (weights.T @ self.products[family.columns]))
        return self._replace(products=products, left=self.left - cross @ inverse @ cross.T)


def _eigenvectors(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the eigenvalues and eigenvectors of a symmetric matrix, at once if it is diagonal.

    That of patterns without a place in common, as those of cells, is.
    """
    diagonal = np.diag(matrix)
    if np.count_nonzero(matrix) <= np.count_nonzero(diagonal):
        order = np.argsort(diagonal)
        return diagonal[order], np.eye(len(diagonal))[:, order]
    return np.linalg.eigh(matrix)


def covariance_of_products(
    result: FitResult,
    camera: Camera,
    rows: Rows,
    patterns: Patterns,
    *,
    all_exposures: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Return `total` and `left` of `Projection`, which the residuals do not change.

    Parameters
    ----------
    all_exposures : whether the sample has them all, of fewer sources
    """
    sample = sample_of(rows, camera, result.sources, all_exposures=all_exposures)
    patterns = patterns.at_times_of(sample.camera)
    parts = [_sums(result, sample.camera, part, patterns) for part in sample.parts]
    total, left = reduce(_Sums.plus, parts).covariance(sample.weight)
    if len(parts) > 1:
        # Few sources leave less of the patterns than all would, because they decide what is fitted
        # less well, and half of them are twice as far off: chi2 would be too large.
        halves = np.mean([part.covariance(sample.weight)[1] for part in parts], axis=0)
        left += (1.0 - sample.share) * (left - halves)
    if result.settings.pixel_phase:
        left[patterns.fast] = left[:, patterns.fast] = 0.0
    return total, left


class _Sums(NamedTuple):
    """Sums over the rows of some sources, less what the positions of these absorb.

    Attributes
    ----------
    weight : of the rows
    total : products of the patterns, before the positions absorb anything
    gram : products of the patterns, and then of what all exposures share
    between : products of the parameters of the exposures with these
    exposures : products of the parameters of the exposures
    fast : what the fit leaves of the patterns that change at random from exposure to exposure
    precision : of the parameters of the exposures, and then of what is shared
    columns : of the patterns that change at random
    """

    weight: float
    total: np.ndarray
    gram: np.ndarray
    between: np.ndarray
    exposures: np.ndarray
    fast: np.ndarray
    precision: np.ndarray
    columns: np.ndarray

    def plus(self, other: "_Sums") -> "_Sums":
        """Return the sums over the rows of both, which have the same exposures."""
        return self._replace(
            weight=self.weight + other.weight,
            total=self.total + other.total,
            gram=self.gram + other.gram,
            between=self.between + other.between,
            exposures=self.exposures + other.exposures,
            fast=self.fast + other.fast,
        )

    def covariance(self, weight: float) -> tuple[np.ndarray, np.ndarray]:
        """Return `total` and `left` of `Projection` if these rows stand for all.

        Parameters
        ----------
        weight : of all rows
        """
        ratio, ours = weight / self.weight, slice(len(self.total))
        shared = slice(len(self.total), None)
        fitted = ratio * np.block(
            [
                [self.exposures, self.between[:, shared]],
                [self.between[:, shared].T, self.gram[shared, shared]],
            ]
        )
        fitted += self.precision
        # Shifts of all exposures against those of all detectors may have no prior.
        fitted[np.diag_indices(len(fitted))] *= 1.0 + 1e-9
        factor = linalg.cholesky(fitted, lower=True, check_finite=False)
        cross = ratio * np.concatenate([self.between[:, ours], self.gram[shared, ours]])
        left = ratio * self.gram[ours, ours]
        absorbed = linalg.solve_triangular(factor, cross, lower=True, check_finite=False)
        left -= absorbed.T @ absorbed
        # In few exposures, a source takes too much of what changes from one exposure to the next.
        left[np.ix_(self.columns, self.columns)] = ratio * self.fast
        return ratio * self.total, left


def _sums(result: FitResult, camera: Camera, rows: Rows, patterns: Patterns) -> _Sums:
    shared = shared_columns(result, camera, rows)
    columns = columns_at(patterns, rows, shared, np.sqrt(rows.weight))
    ours = order_of(patterns, columns.n_scalars)
    order = np.concatenate([ours, np.setdiff1d(np.arange(columns.count), ours)])
    gram, exposures = columns.gram(), with_exposures(result, camera, rows, columns)
    total = gram[np.ix_(ours, ours)]
    absorbed = absorbed_by_positions(result, camera, rows, columns, exposures)
    gram -= absorbed.gram
    number, (_, *vectors) = ours[patterns.fast] - 2 * columns.n_scalars, columns.parts
    kept = np.concatenate([one[:, number] for one in vectors])
    return _Sums(
        float(rows.weight.sum()),
        total,
        gram[np.ix_(order, order)],
        (exposures.with_columns - absorbed.between)[:, order],
        exposures.gram - absorbed.exposures,
        kept.T @ (np.tile(rows.left, 2)[:, None] * kept),
        linalg.block_diag(exposures.precision, np.diag(precision_of(shared))),
        patterns.fast,
    )
