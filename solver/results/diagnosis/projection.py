"""What the fit leaves of patterns in the residuals: their products and the covariance of these.

With the patterns P, the weights W, and the columns J of all that is fitted, the residuals of a
good solution make the products P'Wr normal, with mean zero and the covariance

    V = P'WP - P'WJ (J'WJ + prior)^-1 J'WP,

and a displacement by P times a adds V a to them: V^-1 P'Wr is what a fit with these patterns
would find, and r'WP V^-1 P'Wr what it would take from chi2. J is built anew here, on the focal
plane and for isotropic errors, so that a stored result can be tested. V takes a subset of the
sources, scaled up; the products take all.
"""

from typing import NamedTuple

import numpy as np
from scipy import linalg

from solver.data.result import FitResult
from solver.results.diagnosis.columns import columns_at, order_of
from solver.results.diagnosis.fitted import (
    precision_of,
    shared_columns,
    with_exposures,
    with_sources,
)
from solver.results.diagnosis.patterns import Family, Patterns
from solver.results.diagnosis.rows import Camera, Rows

# Measurements from which the covariance is computed, and exposures of each span.
_MOST_ROWS, _LEAST_EXPOSURES = 12_000, 4
# Of sums of weights, relative.
_ROUNDING = 1e-9
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
        weights = np.eye(len(family.columns)) if family.weights is None else family.weights
        products = weights.T @ self.products[family.columns]
        square = np.ix_(family.columns, family.columns)
        total = weights.T @ self.total[square] @ weights
        left = weights.T @ self.left[square] @ weights
        # In directions in which the patterns are independent before the fit.
        values, vectors = linalg.eigh(total)
        whole = values > 1e-9 * values[-1]
        scaled = vectors[:, whole] / np.sqrt(values[whole])
        shares, turned = linalg.eigh(scaled.T @ left @ scaled)
        is_left = shares > _LEAST_LEFT
        basis = scaled @ turned[:, is_left]
        along = basis.T @ products
        found = basis @ (along / shares[is_left])
        chi2 = float(np.sum(along**2 / shares[is_left]))
        size = float(np.sqrt(max(found @ total @ found, 0.0) / max(self.weight, 1e-300)))
        return Evidence(chi2, int(is_left.sum()), weights @ found, size)

    def without(self, family: Family) -> "Projection":
        """Return the projection after the patterns of a family are fitted, too."""
        weights = np.eye(len(family.columns)) if family.weights is None else family.weights
        cross = self.left[:, family.columns] @ weights
        own = weights.T @ self.left[np.ix_(family.columns, family.columns)] @ weights
        inverse = linalg.pinvh(own, rtol=1e-6)
        products = self.products - cross @ (inverse @ (weights.T @ self.products[family.columns]))
        return self._replace(products=products, left=self.left - cross @ inverse @ cross.T)


def covariance_of_products(
    result: FitResult, camera: Camera, rows: Rows, patterns: Patterns
) -> tuple[np.ndarray, np.ndarray]:
    """Return `total` and `left` of `Projection`, which the residuals do not change."""
    some, ratio = _subset(rows, camera, len(result.sources))
    shared = shared_columns(result, camera, some)
    columns = columns_at(patterns, some).with_(shared, np.sqrt(some.weight))
    ours = order_of(patterns, columns.scalar.shape[1])
    others = np.setdiff1d(np.arange(columns.count), ours)
    # All sums over the rows, less what the positions of the sources absorb.
    gram, exposures = columns.gram(), with_exposures(result, camera, some, columns)
    total = ratio * gram[np.ix_(ours, ours)]
    of_columns, of_exposures = with_sources(result, camera, some, columns, exposures)
    gram -= of_columns.T @ of_columns
    between = exposures.with_columns - of_exposures.T @ of_columns
    fitted = ratio * np.block(
        [
            [exposures.gram - of_exposures.T @ of_exposures, between[:, others]],
            [between[:, others].T, gram[np.ix_(others, others)]],
        ]
    )
    fitted += linalg.block_diag(exposures.precision, np.diag(precision_of(shared)))
    # Shifts of all exposures against those of all detectors may have no prior.
    fitted[np.diag_indices(len(fitted))] *= 1.0 + 1e-9
    factor = linalg.cho_factor(fitted, lower=True, check_finite=False)
    cross = ratio * np.concatenate([between[:, ours], gram[np.ix_(others, ours)]])
    left = ratio * gram[np.ix_(ours, ours)]
    left -= cross.T @ linalg.cho_solve(factor, cross, check_finite=False)
    # In few exposures, a source takes too much of what changes from one exposure to the next.
    fast = patterns.fast
    number = ours[fast] - 2 * columns.scalar.shape[1]
    kept = np.concatenate([columns.x[:, number], columns.y[:, number]])
    left[np.ix_(fast, fast)] = ratio * kept.T @ (np.tile(some.left, 2)[:, None] * kept)
    if result.settings.pixel_phase:
        left[fast] = left[:, fast] = 0.0
    return total, left


def _subset(rows: Rows, camera: Camera, n_sources: int) -> tuple[Rows, float]:
    """Return a part of the rows that stands for all, and how many of its sources one stands for.

    A source stays at one place of the focal plane while a field is exposed. So few exposures of
    each field, or of each span of it, have nearly all that the data say, if each is given the
    weight of those about it: the ones of most weight, since the noise may differ between exposures.
    What counts are the sources: of these, as many are taken as there is time for.
    """
    each = max(int(_MOST_ROWS / max(rows.n, 1) * len(camera.time) / (camera.span.max() + 1)), 0)
    of_exposure = np.bincount(rows.exposure, rows.weight, len(camera.time))
    factor = np.zeros(len(camera.time))
    for span in np.unique(camera.span):
        of_span = np.flatnonzero(camera.span == span)
        count = min(max(each, _LEAST_EXPOSURES), len(of_span))
        for group in np.array_split(of_span, count):
            # The first of equal ones: their sums differ by rounding, with the order of the rows.
            is_heavy = of_exposure[group] >= (1.0 - _ROUNDING) * of_exposure[group].max()
            heaviest = group[np.argmax(is_heavy)]
            factor[heaviest] = of_exposure[group].sum() / max(of_exposure[heaviest], 1e-300)
    some = rows.of(np.flatnonzero(factor[rows.exposure] > 0.0))
    some = some._replace(weight=some.weight * factor[some.exposure])
    if some.n <= _MOST_ROWS:
        return some, 1.0
    order = np.random.default_rng(0).permutation(n_sources)
    counts = np.bincount(some.source, minlength=n_sources)[order]
    chosen = np.zeros(n_sources, dtype=bool)
    chosen[order[: int(np.searchsorted(np.cumsum(counts), _MOST_ROWS)) + 1]] = True
    part = some.of(np.flatnonzero(chosen[some.source]))
    return part, float(some.weight.sum() / part.weight.sum())
