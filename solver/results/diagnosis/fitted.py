"""What is fitted, on the focal plane: of all exposures, of each of them, and of each source."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import sparse

from solver.data.distortion_terms import terms
from solver.data.result import FitResult
from solver.results.diagnosis.columns import Columns
from solver.results.diagnosis.modelled import (
    Column,
    Scalar,
    Vector,
    has_anisotropy,
    modelled,
    prior_widths,
    walk_precision,
    walk_terms,
)
from solver.results.diagnosis.patterns import legendre_at
from solver.results.diagnosis.rows import Camera, Rows, onto_focal_plane
from solver.units import RAD_PER_ARCSEC

_PPM = 1e-6
# Highest degree of a distortion.
_HIGHEST = 9
# Shift along x and y, turn, scale and anisotropy, from 1, x and y: along x, and along y.
_IN_X = np.array([[1.0, 0, 0], [0, 0, 0], [0, 0, -1], [0, 1, 0], [0, -1, 0]])
_IN_Y = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1]])


def shared_columns(result: FitResult, camera: Camera, rows: Rows) -> list[Column]:
    """Return the columns of what exposures share: detectors, distortion and the fitted causes.

    They are per um of the detectors' places, pitches and the distortion, per rad, and per unit of
    each cause.
    """
    width = prior_widths(result)
    pixel, zeros = rows.pixel * camera.pitch[rows.detector], np.zeros(rows.n)
    vectors = (
        ("detector_rotation", (-pixel[:, 1], pixel[:, 0]), RAD_PER_ARCSEC),
        ("pitch_x", (rows.pixel[:, 0], zeros), 1.0),
        ("pitch_y", (zeros, rows.pixel[:, 1]), 1.0),
    )
    turned = [
        (name, onto_focal_plane(np.stack(vector, axis=1), camera.turn, rows.detector).T, unit)
        for name, vector, unit in vectors
    ]
    columns: list[Column] = []
    for d in range(len(camera.turn)):
        on = (rows.detector == d).astype(float)
        columns.append(Scalar(on, width["detector_x"][d], width["detector_y"][d]))
        columns += [Vector(x * on, y * on, unit * width[name][d]) for name, (x, y), unit in turned]
    in_x, in_y = (legendre_at(along, _HIGHEST) for along in rows.at.T)
    for number, (k, j) in enumerate(terms(int(result.summary["order"]))):
        sigmas = (width[f"distortion_{axis}"][number] for axis in "xy")
        columns.append(Scalar(in_x[k] * in_y[j], *sigmas))
    return [*columns, *modelled(result, camera, rows, width)]


def precision_of(columns: Sequence[Column]) -> np.ndarray:
    """Return the precision of the priors of parameters, in the order of `Columns`."""
    scalars = [one for one in columns if isinstance(one, Scalar)]
    sigmas = [one.sigma_x for one in scalars] + [one.sigma_y for one in scalars]
    sigmas += [one.sigma for one in columns if isinstance(one, Vector)]
    return 1.0 / np.square(np.maximum(sigmas, 1e-12))


class OfExposures(NamedTuple):
    """Parameters of each exposure: shift along x and y, turn, scale, and causes that are fitted.

    These are the anisotropy, and the terms of the distortion that walk, along x and then along y.
    Exposures without rows have none.

    Attributes
    ----------
    gram : products with each other, shape (parameters, parameters)
    with_columns : with columns, shape (parameters, columns)
    precision : of their priors, shape (parameters, parameters)
    basis : functions of the exposure of each row, weighted, shape (n, functions x exposures)
    in_x, in_y : displacement along x and along y by each parameter of an exposure, from the
        functions, shape (parameters, functions)
    """

    gram: np.ndarray
    with_columns: np.ndarray
    precision: np.ndarray
    basis: sparse.csr_matrix
    in_x: np.ndarray
    in_y: np.ndarray


def with_exposures(result: FitResult, camera: Camera, rows: Rows, columns: Columns) -> OfExposures:
    """Return the parameters of each exposure, and their products with columns."""
    taken = np.flatnonzero(np.diff(rows.first))
    walk = walk_terms(result, rows)
    in_walk = walk_precision(result, taken) if walk else []
    in_x, in_y, own_precision = _of_one_exposure(result, camera, len(walk))
    basis = np.sqrt(rows.weight) * np.stack([np.ones(rows.n), *rows.at.T, *walk])
    kinds, width = in_x.shape
    precision = np.zeros((len(taken), kinds, len(taken), kinds))
    in_walks = [of_axis for of_axis in in_walk for _ in walk]
    for kind, one in enumerate([*own_precision, *in_walks]):
        precision[:, kind, :, kind] = one * np.eye(len(taken)) if np.ndim(one) == 0 else one
    gram = np.zeros((len(taken), kinds, len(taken), kinds))
    products = np.empty((len(taken), kinds, columns.count))
    for e, (first, last) in enumerate(zip(rows.first[taken], rows.first[taken + 1], strict=True)):
        own = basis[:, first:last]
        square, with_values = own @ own.T, own @ columns.values[first:last]
        products[e] = columns.from_axes(in_x @ with_values, in_y @ with_values)
        gram[e, :, e] = in_x @ square @ in_x.T + in_y @ square @ in_y.T
    size = len(taken) * kinds
    place = width * np.searchsorted(taken, rows.exposure)[:, None] + np.arange(width)
    each = (basis.T.ravel(), place.ravel(), width * np.arange(rows.n + 1))
    return OfExposures(
        gram.reshape(size, size),
        products.reshape(size, -1),
        precision.reshape(size, size),
        sparse.csr_matrix(each, shape=(rows.n, width * len(taken))),
        in_x,
        in_y,
    )


def _of_one_exposure(
    result: FitResult, camera: Camera, n_walk: int
) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Return `in_x` and `in_y` of `OfExposures`, and the precision of all but the walks."""
    precision = [0.0] * 4
    if has_anisotropy(result):
        width = float(result.values_of("focal_anisotropy", "prior_sigma")[0])
        precision.append((0.5 * _PPM * width * camera.scale) ** -2)
    first, width = len(precision), _IN_X.shape[1]
    in_x, in_y = np.zeros((2, first + 2 * n_walk, width + n_walk))
    in_x[:first, :width], in_y[:first, :width] = _IN_X[:first], _IN_Y[:first]
    in_x[first : first + n_walk, width:] = in_y[first + n_walk :, width:] = np.eye(n_walk)
    return in_x, in_y, precision


def source_variances(result: FitResult, camera: Camera) -> np.ndarray:
    """Return the variance of the prior of each source, along one axis, um^2, shape (sources,)."""
    ra, dec = (result.sources[f"prior_sigma_{axis}"].to_numpy(float) for axis in ("ra", "dec"))
    return 0.5 * camera.um_per_mas**2 * (np.square(ra) + np.square(dec))


class Absorbed(NamedTuple):
    """What the positions of the sources absorb of products over all rows.

    Attributes
    ----------
    gram : of the columns with each other, shape (columns, columns)
    between : of the parameters of the exposures with the columns, shape (parameters, columns)
    exposures : of these parameters with each other, shape (parameters, parameters)
    """

    gram: np.ndarray
    between: np.ndarray
    exposures: np.ndarray


def absorbed_by_positions(
    result: FitResult, camera: Camera, rows: Rows, columns: Columns, exposures: OfExposures
) -> Absorbed:
    """Return what the positions absorb.

    It is the square of the products of a position with columns, over the root of its precision if
    all else is held fixed.
    """
    source, known = pd.factorize(rows.source)
    count = len(known)
    prior = source_variances(result, camera)[known]
    precision = np.bincount(source, rows.weight, count) + 1.0 / prior
    order = np.argsort(source, kind="stable")
    ends = np.cumsum(np.bincount(source, minlength=count))
    factor = np.sqrt(rows.weight / precision[source])[order]
    roll = camera.roll[rows.exposure[order]]
    # A displacement (x, y) moves a star by (x cos - y sin, x sin + y cos) of the roll. Sums of the
    # values times the cosine come first, and times the sine after them: their squares are products
    # of x with x and of y with y, and what is across them those of x with y.
    waves, starts = np.concatenate([np.cos(roll), np.sin(roll)]), [0, *ends, *(rows.n + ends)]
    onto_sky = sparse.csr_matrix(
        (np.tile(factor, 2) * waves, np.tile(order, 2), starts), shape=(2 * count, rows.n)
    )
    on_sky = onto_sky @ columns.values
    across = on_sky[count:].T @ on_sky[:count]
    in_x, in_y = exposures.in_x.T, exposures.in_y.T
    cosine, sine = np.split((onto_sky @ exposures.basis).toarray().reshape(-1, len(in_x)), 2)
    ra = (cosine @ in_x - sine @ in_y).reshape(count, -1)
    dec = (sine @ in_x + cosine @ in_y).reshape(count, -1)
    # Along x, and along y.
    both = np.block([[ra, dec], [dec, -ra]])
    with_values = np.split(both.T @ on_sky, 2)
    return Absorbed(
        columns.products(on_sky.T @ on_sky, across - across.T),
        columns.from_axes(*with_values),
        ra.T @ ra + dec.T @ dec,
    )
