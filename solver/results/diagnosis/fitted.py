"""What is fitted, on the focal plane: of all exposures, of each of them, and of each source."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import linalg, sparse

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
    calibration, width = result.calibration, prior_widths(result)
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
    labels = calibration.loc[calibration["group"] == "distortion_x", "label"]
    in_x, in_y = (legendre_at(along, _HIGHEST) for along in rows.at.T)
    for number, label in enumerate(labels):
        k, j = (int(one) for one in label[2:-1].split(","))
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
    walk, in_walk = walk_terms(result, rows), walk_precision(result, taken)
    in_x, in_y, own_precision = _of_one_exposure(result, camera, len(walk))
    basis = np.sqrt(rows.weight) * np.stack([np.ones(rows.n), *rows.at.T, *walk])
    kinds, width = in_x.shape
    precision = np.zeros((len(taken), kinds, len(taken), kinds))
    for kind, one in enumerate([*own_precision, *np.repeat(in_walk, len(walk), axis=0)]):
        precision[:, kind, :, kind] = one * np.eye(len(taken)) if np.ndim(one) == 0 else one
    n = columns.scalar.shape[1]
    gram = np.zeros((len(taken), kinds, len(taken), kinds))
    products = np.empty((len(taken), kinds, columns.count))
    for e, (first, last) in enumerate(zip(rows.first[taken], rows.first[taken + 1], strict=True)):
        own, some = basis[:, first:last], columns.of(slice(first, last))
        scalar, square = own @ some.scalar, own @ own.T
        products[e, :, :n], products[e, :, n : 2 * n] = in_x @ scalar, in_y @ scalar
        products[e, :, 2 * n :] = in_x @ (own @ some.x) + in_y @ (own @ some.y)
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
        rows_of = result.calibration["group"] == "focal_anisotropy"
        width = float(result.calibration.loc[rows_of, "prior_sigma"].iloc[0])
        precision.append((0.5 * _PPM * width * camera.scale) ** -2)
    none, each = np.zeros((n_walk, n_walk)), np.eye(n_walk)
    in_x, in_y = (
        linalg.block_diag(one[: len(precision)], np.concatenate(walks))
        for one, walks in ((_IN_X, (each, none)), (_IN_Y, (none, each)))
    )
    return in_x, in_y, precision


def source_variances(result: FitResult, camera: Camera) -> np.ndarray:
    """Return the variance of the prior of each source, along one axis, um^2, shape (sources,)."""
    sigmas = result.sources[["prior_sigma_ra", "prior_sigma_dec"]].to_numpy()
    return camera.um_per_mas**2 * np.square(sigmas).mean(axis=1)


def with_sources(
    result: FitResult, camera: Camera, rows: Rows, columns: Columns, exposures: OfExposures
) -> tuple[np.ndarray, np.ndarray]:
    """Return the products of the positions with columns, and with those of the exposures.

    They are over the root of the precision of the positions if all else is held fixed, so that
    their squares are what the positions absorb; shapes (2 sources, columns), and (2 sources,
    parameters of the exposures).
    """
    source, known = pd.factorize(rows.source)
    n, count = columns.scalar.shape[1], len(known)
    prior = source_variances(result, camera)[known]
    precision = np.bincount(source, rows.weight, count) + 1.0 / prior
    factor = np.sqrt(rows.weight / precision[source])
    roll = camera.roll[rows.exposure]
    c, s = (
        sparse.csr_matrix((factor * values, (source, np.arange(rows.n))), shape=(count, rows.n))
        for values in (np.cos(roll), np.sin(roll))
    )
    of_columns = np.empty((2 * count, columns.count))
    ra, dec = of_columns[:count], of_columns[count:]
    ra[:, :n] = dec[:, n : 2 * n] = c @ columns.scalar
    dec[:, :n] = s @ columns.scalar
    ra[:, n : 2 * n] = -dec[:, :n]
    ra[:, 2 * n :] = c @ columns.x - s @ columns.y
    dec[:, 2 * n :] = s @ columns.x + c @ columns.y
    in_x, in_y = exposures.in_x.T, exposures.in_y.T
    along, across = ((one @ exposures.basis).toarray().reshape(-1, len(in_x)) for one in (c, s))
    of_exposures = np.concatenate([along @ in_x - across @ in_y, across @ in_x + along @ in_y])
    return of_columns, of_exposures.reshape(2 * count, -1)
