"""The test for smooth errors of the catalogue, in the orbits of a run together.

The unknown field is a polynomial on the sky, about which smooth random fields say how large each
coefficient should be against the others. Its effect is told from what is fixed to the focal plane:
quadratic terms of the distortion, the same in all orbits but for a linear trend. What is left of
the statistics of all orbits is noise, and errors of single reference stars that the orbits share.
Each direction of the field counts in the test as much as the orbits would show it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
import scipy.linalg as sl
from jaxtyping import Float, Int
from scipy.optimize import brentq
from scipy.special import chdtri, j0

from solver.data.run_schema import FIELD_DEGREES, ZONAL_FIELD
from solver.results.diagnosis.rate import log_chance, sigmas
from solver.results.diagnosis.survey.frames import Frames
from solver.results.diagnosis.survey.sky_orbit import N_FIELDS, N_FRAME, SkyOrbit
from solver.results.diagnosis.survey.weighted_squares import WeightedSquares

# With fewer orbits, a season has too few.
LEAST_ORBITS = 8
# Wavelengths of the expected fields, deg.
_WAVELENGTHS_DEG = np.linspace(1.5, 3.0, 16)
# Directions with less of the information than this share of the best hold rounding errors.
_LEAST_SHARE = 1e-6
_GRID = 15
# Chance of a field that counts as seen, among the tests of a run.
_SEEN = 4e-4
# Range of the typical size of a field, times the best information, in which it is looked for.
_SIZES = 1e-12, 1e12
# Relative to its diagonal, added to a covariance that is singular but for rounding.
_RIDGE = 1e-6


class Zonal(NamedTuple):
    """The test for smooth errors of the catalogue.

    Attributes
    ----------
    chi2, dof : a chi2 with the chance of the weighted sum of squares that is tested
    log_chance, sigma : of a chi2 as large by chance
    rms_mas : of the field where the orbits show it, along one axis; 0 if chance would do
    typical_mas : rms that would be seen in half of all such runs
    coefficients : of the most likely field, mas, as in `polynomial_fields`
    scatter : root of their covariance by chance: fields, each a column, that add in squares
    half_width : of the area about the centre, deg to the East and North
    """

    chi2: float
    dof: float
    log_chance: float
    sigma: float
    rms_mas: float
    typical_mas: float
    coefficients: Float[np.ndarray, " field"]
    scatter: Float[np.ndarray, "field _"]
    half_width: Float[np.ndarray, " 2"]


class _System(NamedTuple):
    """Whitened statistics, and how they change with the field and with the distortion."""

    values: Float[np.ndarray, " row"]
    by_field: Float[np.ndarray, "row field"]
    by_distortion: Float[np.ndarray, "row term"]


def zonal_test(
    orbits: Sequence[SkyOrbit], frames: Frames, half_width: Float[np.ndarray, " 2"]
) -> Zonal:
    """Return the test for smooth errors of the catalogue.

    Parameters
    ----------
    frames : of the same orbits
    half_width : of the area in which the fields are looked for, deg
    """
    system = _whitened(orbits, frames)
    basis, _ = np.linalg.qr(system.by_distortion)
    values, by_field = (
        part - basis @ (basis.T @ part) for part in (system.values, system.by_field)
    )
    root = np.linalg.cholesky(_expected(half_width) + _RIDGE * np.eye(N_FIELDS))
    information, vectors = np.linalg.eigh(root.T @ by_field.T @ by_field @ root)
    known = information > _LEAST_SHARE * information[-1]
    information, directions = information[known], root @ vectors[:, known]
    deviates = directions.T @ (by_field.T @ values) / np.sqrt(information)
    # The deviates have the variance 1 + size information, so that these weights tell best a field
    # of this size from none. It is the one that is seen in half of the runs.
    typical = _typical_size(information)
    weights = typical * information / (1.0 + typical * information)
    total, squares = float(weights @ deviates**2), WeightedSquares.of(weights)
    chi2 = squares.chi2(total)
    chance = log_chance(chi2, squares.dof)
    square = max((total - float(weights.sum())) / float(weights @ information), 0.0)
    # The most likely field, if one of this size, or one that could just be seen, is expected.
    size = max(square, typical)
    shrunk = size * np.sqrt(information) / (1.0 + size * information)
    return Zonal(
        chi2,
        squares.dof,
        chance,
        sigmas(chance),
        float(np.sqrt(square)),
        float(np.sqrt(typical)),
        directions @ (shrunk * deviates),
        directions * shrunk,
        half_width,
    )


def _typical_size(information: Float[np.ndarray, " direction"]) -> float:
    """Return the mean square of the fields of which half are seen with the best weights for it."""

    def excess(log_size: float) -> float:
        shares = np.exp(log_size) * information
        weights = shares / (1.0 + shares)
        of_none, of_field = (
            WeightedSquares.of(weights),
            WeightedSquares.of(weights * (1.0 + shares)),
        )
        seen = of_none.total(float(chdtri(of_none.dof, _SEEN)))
        return of_field.total(float(chdtri(of_field.dof, 0.5))) - seen

    low, high = (float(np.log(one / information.max())) for one in _SIZES)
    return float(np.exp(brentq(excess, low, high)))


def _whitened(orbits: Sequence[SkyOrbit], frames: Frames) -> _System:
    """Return all statistics with unit covariance: distortions, frames, and slopes added up."""
    n_terms, n_frames = orbits[0].n_terms, len(frames.values)
    first = n_terms * len(orbits)
    size = first + n_frames + N_FIELDS
    stars: Int[np.ndarray, " star"] = np.unique(np.concatenate([one.source_id for one in orbits]))
    values, by_field = np.zeros(size), np.zeros((size, N_FIELDS))
    by_distortion, by_star = np.zeros((size, 2 * n_terms)), np.zeros((size, len(stars), 2))
    noise = np.zeros((size, size))
    values[first:-N_FIELDS] = frames.values
    noise[first:-N_FIELDS, first:-N_FIELDS] = np.eye(n_frames)
    for number, (orbit, moment) in enumerate(zip(orbits, _moments(orbits), strict=True)):
        terms = slice(n_terms * number, n_terms * (number + 1))
        summed = np.zeros((size, len(orbit.values)))
        summed[terms, :n_terms] = np.eye(n_terms)
        coefficients = slice(N_FRAME * number, N_FRAME * (number + 1))
        summed[first:-N_FIELDS, n_terms:-N_FIELDS] = frames.by_frame[:, coefficients]
        summed[-N_FIELDS:, -N_FIELDS:] = np.eye(N_FIELDS)
        values += summed @ orbit.values
        by_field += summed @ orbit.by_field
        noise += summed @ orbit.noise @ summed.T
        of_orbit = np.searchsorted(stars, orbit.source_id)
        by_star[:, of_orbit] += np.einsum("rs,ska->rka", summed, orbit.by_star, optimize=True)
        by_distortion[terms] = np.kron([1.0, moment], np.eye(n_terms))
    flat = by_star.reshape(size, -1)
    covariance = noise + flat @ flat.T
    scale = 1.0 / np.sqrt(np.diag(covariance))
    covariance *= scale[:, None] * scale
    factor = np.linalg.cholesky(covariance + _RIDGE * np.eye(size))
    return _System(
        *(
            sl.solve_triangular(factor, (part.T * scale).T, lower=True)
            for part in (values, by_field, by_distortion)
        )
    )


def _moments(orbits: Sequence[SkyOrbit]) -> Float[np.ndarray, " orbit"]:
    """Return the epochs of the orbits, from -1 to 1."""
    epochs = np.array([one.epoch for one in orbits])
    middle, half = 0.5 * (epochs.max() + epochs.min()), 0.5 * np.ptp(epochs)
    return (epochs - middle) / max(half, 1e-9)


def _expected(half_width: Float[np.ndarray, " 2"]) -> Float[np.ndarray, "field field"]:
    """Return the covariance of the polynomials that fit random fields of unit rms on the area."""
    grid = np.linspace(-1.0, 1.0, _GRID)
    at = np.stack(np.meshgrid(*(half * grid for half in half_width)), axis=-1).reshape(-1, 2)
    distance = np.sqrt(np.sum((at[:, None] - at) ** 2, axis=-1))
    # Of waves in all directions.
    alike = np.mean([j0(2.0 * np.pi / one * distance) for one in _WAVELENGTHS_DEG], axis=0)
    monomials = np.array([at[:, 0] ** i * at[:, 1] ** j for i, j in FIELD_DEGREES]).T
    fitted = np.linalg.pinv(monomials)
    return np.kron(np.eye(2), fitted @ alike @ fitted.T)


def zonal_field(found: Zonal, centre: tuple[float, float]) -> pd.DataFrame:
    """Return `run_schema.ZONAL_FIELD` of a test.

    Parameters
    ----------
    centre : of the polynomials, deg
    """
    degrees = np.array(FIELD_DEGREES)
    columns: dict[str, object] = {
        "axis": np.repeat(["ra", "dec"], len(degrees)),
        "degree_ra": np.tile(degrees[:, 0], 2),
        "degree_dec": np.tile(degrees[:, 1], 2),
        "coefficient": found.coefficients,
    }
    n_unused = N_FIELDS - found.scatter.shape[1]
    scatter = np.pad(found.scatter, ((0, 0), (0, n_unused)))
    columns |= {f"scatter_{number:02d}": column for number, column in enumerate(scatter.T)}
    columns |= {"centre_ra": centre[0], "centre_dec": centre[1]}
    columns |= {"half_ra": found.half_width[0], "half_dec": found.half_width[1]}
    columns |= {"chi2": found.chi2, "dof": found.dof}
    columns |= {"rms": found.rms_mas, "typical": found.typical_mas}
    return pd.DataFrame(columns)[ZONAL_FIELD.names]
