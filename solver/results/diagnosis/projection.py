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
import pandas as pd
from scipy import linalg, sparse

from solver.data.result import FitResult
from solver.results.diagnosis.modelled import has_anisotropy, modelled
from solver.results.diagnosis.patterns import Family, Patterns, legendre_at
from solver.results.diagnosis.rows import Camera, Rows, onto_focal_plane

# Measurements from which the covariance is computed, and exposures of each field.
_MOST_ROWS, _LEAST_EXPOSURES = 12_000, 4
_ARCSEC_RAD, _PPM = np.pi / 180.0 / 3600.0, 1e-6
# Of sums of weights, relative.
_ROUNDING = 1e-9
# Directions of which the fit leaves less than this share are not tested.
_LEAST_LEFT = 0.02
# Highest degree of a distortion.
_HIGHEST = 9


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


def project(result: FitResult, camera: Camera, rows: Rows, patterns: Patterns) -> Projection:
    """Return the products of the patterns with the residuals, and their covariance."""
    some, ratio = _subset(rows, camera, len(result.sources))
    root = np.sqrt(some.weight)
    shape = (-1, 2 * some.n)
    of_patterns = (patterns.of_rows(some) * root).reshape(shape)
    shared, precision = _shared(result, camera, some)
    dense = np.concatenate([of_patterns, (shared * root).reshape(shape)])
    own, own_precision = _of_exposures(result, camera, some, root)
    sources, places = _of_sources(result, camera, some, root)
    # All sums over the rows, less what the positions of the sources absorb.
    with_sources = np.asarray(sources @ dense.T)
    own_sources = (sources @ own.T).toarray()
    gram = dense @ dense.T
    total = ratio * gram[: len(patterns), : len(patterns)]
    gram -= with_sources.T @ (places[:, None] * with_sources)
    between = np.asarray(own @ dense.T) - own_sources.T @ (places[:, None] * with_sources)
    exposures = (own @ own.T).toarray() - own_sources.T @ (places[:, None] * own_sources)
    n, n_own = len(patterns), own.shape[0]
    fitted = np.empty((n_own + len(precision),) * 2)
    fitted[:n_own, :n_own] = exposures
    fitted[:n_own, n_own:] = between[:, n:]
    fitted[n_own:, :n_own] = between[:, n:].T
    fitted[n_own:, n_own:] = gram[n:, n:]
    cross = ratio * np.concatenate([between[:, :n], gram[n:, :n]])
    fitted *= ratio
    fitted[np.diag_indices(len(fitted))] += np.concatenate([own_precision, precision])
    # Shifts of all exposures against those of all detectors may have no prior.
    fitted[np.diag_indices(len(fitted))] *= 1.0 + 1e-9
    factor = linalg.cho_factor(fitted, lower=True, check_finite=False)
    left = ratio * gram[:n, :n] - cross.T @ linalg.cho_solve(factor, cross, check_finite=False)
    # In few exposures, a source takes too much of what changes from one exposure to the next.
    fast = np.ix_(patterns.fast, patterns.fast)
    kept = of_patterns[patterns.fast] * np.tile(np.sqrt(some.left), 2)
    left[fast] = ratio * (kept @ kept.T)
    if result.settings.pixel_phase:
        left[patterns.fast] = left[:, patterns.fast] = 0.0
    return Projection(patterns.products(rows), total, left, float(rows.weight.sum()))


def _subset(rows: Rows, camera: Camera, n_sources: int) -> tuple[Rows, float]:
    """Return a part of the rows that stands for all, and how many of its sources one stands for.

    A source stays at one place of the focal plane while a field is exposed. So few exposures of
    each field have nearly all that the data say, if each is given the weight of those about it:
    the ones of most weight, since the noise may differ between exposures. What counts are the
    sources: of these, as many are taken as there is time for.
    """
    each = max(int(_MOST_ROWS / max(rows.n, 1) * len(camera.time) / (camera.field.max() + 1)), 0)
    of_exposure = np.bincount(rows.exposure, rows.weight, len(camera.time))
    factor = np.zeros(len(camera.time))
    for field in np.unique(camera.field):
        of_field = np.flatnonzero(camera.field == field)
        count = min(max(each, _LEAST_EXPOSURES), len(of_field))
        for group in np.array_split(of_field, count):
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


def _shared(result: FitResult, camera: Camera, rows: Rows) -> tuple[np.ndarray, np.ndarray]:
    """Return the columns of what exposures share, and the precision of their priors.

    These are the detectors, the distortion and the causes that the fit includes. Shapes
    (columns, 2, n) and (columns,); per um, rad, um and um, and per unit of each cause.
    """
    calibration = result.calibration
    width = {name: rows_["prior_sigma"].to_numpy() for name, rows_ in calibration.groupby("group")}
    n_det, n = len(camera.turn), rows.n
    turn, columns, sigmas = camera.turn[rows.detector], [], []
    pixel = rows.pixel * camera.pitch[rows.detector]
    ones, zeros = np.ones(n), np.zeros(n)
    kinds = (
        ("detector_x", (ones, zeros), 1.0),
        ("detector_y", (zeros, ones), 1.0),
        (
            "detector_rotation",
            onto_focal_plane(np.stack([-pixel[:, 1], pixel[:, 0]], axis=1), turn).T,
            _ARCSEC_RAD,
        ),
        ("pitch_x", onto_focal_plane(np.stack([rows.pixel[:, 0], zeros], axis=1), turn).T, 1.0),
        ("pitch_y", onto_focal_plane(np.stack([zeros, rows.pixel[:, 1]], axis=1), turn).T, 1.0),
    )
    for name, vector, unit in kinds:
        for d in range(n_det):
            columns.append(np.asarray(vector) * (rows.detector == d))
            sigmas.append(unit * width[name][d])
    labels = calibration.loc[calibration["group"] == "distortion_x", "label"]
    in_x, in_y = (legendre_at(along, _HIGHEST) for along in rows.at.T)
    for number, label in enumerate(labels):
        k, j = (int(one) for one in label[2:-1].split(","))
        value = in_x[k] * in_y[j]
        for axis, name in enumerate(("distortion_x", "distortion_y")):
            vector = np.zeros((2, n))
            vector[axis] = value
            columns.append(vector)
            sigmas.append(width[name][number])
    for cause in modelled(result, camera, rows):
        columns.append(np.stack([cause.x, cause.y]))
        sigmas.append(cause.sigma)
    return np.stack(columns), 1.0 / np.square(np.maximum(sigmas, 1e-12))


def _of_exposures(
    result: FitResult, camera: Camera, rows: Rows, root: np.ndarray
) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return the columns of each exposure, and the precision of their priors.

    They are shift along x and y, turn, scale and, where the fit has it, the anisotropy; shapes
    (columns, 2 n) and (columns,). Exposures without rows have none.
    """
    n, x, y = rows.n, *(root * rows.at.T)
    none = np.zeros(n)
    parts = [(root, none), (none, root), (-y, x), (x, y)]
    precision = [0.0] * len(parts)
    if has_anisotropy(result):
        parts.append((-x, y))
        rows_of = result.calibration["group"] == "focal_anisotropy"
        width = float(result.calibration.loc[rows_of, "prior_sigma"].iloc[0])
        precision.append((0.5 * _PPM * width * camera.scale) ** -2)
    code, taken = pd.factorize(rows.exposure)
    line = np.concatenate([len(parts) * code + number for number in range(len(parts))])
    along = np.tile(np.arange(n), len(parts))
    in_x, in_y = (np.concatenate([part[axis] for part in parts]) for axis in (0, 1))
    lines, places = np.concatenate([line, line]), np.concatenate([along, n + along])
    shape = (len(parts) * len(taken), 2 * n)
    columns = sparse.csr_matrix((np.concatenate([in_x, in_y]), (lines, places)), shape=shape)
    columns.eliminate_zeros()
    return columns, np.tile(precision, len(taken))


def _of_sources(
    result: FitResult, camera: Camera, rows: Rows, root: np.ndarray
) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return the columns of the sources, shape (2 sources, 2 n), and the variances, um^2.

    The variances are those of the positions if all else is held fixed, shape (2 sources,).
    """
    n = rows.n
    source, known = pd.factorize(rows.source)
    roll = camera.roll[rows.exposure]
    c, s = root * np.cos(roll), root * np.sin(roll)
    along = np.arange(n)
    line = np.concatenate([2 * source, 2 * source + 1, 2 * source, 2 * source + 1])
    place = (line, np.concatenate([along, along, n + along, n + along]))
    columns = sparse.csr_matrix(
        (np.concatenate([c, s, -s, c]), place), shape=(2 * len(known), 2 * n)
    )
    names = ["prior_sigma_ra", "prior_sigma_dec"]
    prior = camera.um_per_mas**2 * np.square(result.sources[names].to_numpy()[known]).mean(axis=1)
    precision = np.bincount(source, rows.weight, minlength=len(known)) + 1.0 / prior
    return columns, np.repeat(1.0 / precision, 2)
