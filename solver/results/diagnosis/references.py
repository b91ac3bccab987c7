"""Tests of the stars' catalogue positions against the measurements.

The estimate minus the catalogue position of a star has the covariance P - C, with P of the
catalogue and C of the estimate. Its chi2 is that of the catalogue position against the fit
without it (leave one out), with two degrees of freedom.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import brentq
from scipy.special import chdtrc

from solver.data.result import FitResult

# Below this share of the catalogue's variance that the measurements remove, they say nothing.
_LEAST_SHARE = 1e-6
# Median of a chi2 with two degrees of freedom.
MEDIAN_CHI2 = 1.3863
_LARGEST_FACTOR = 1e6
# Of the logarithm of a factor.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class CatalogueChi2:
    """The catalogue position of each star of a kind against the fit without it.

    Attributes
    ----------
    source_id : of the stars that the measurements determine, shape (n,)
    stars : their deviations from the catalogue
    shift : of the fitted positions by an error of the model, rms along each axis, mas
    """

    source_id: np.ndarray
    stars: "AgainstCatalogue"
    shift: float

    @cached_property
    def chi2(self) -> np.ndarray:
        """Of each star, with two degrees of freedom, shape (n,)."""
        return _chi2(*self._parts, 1.0)

    @cached_property
    def factor(self) -> float:
        """By how much the errors of the catalogue are larger than stated, at least 1.

        The median chi2 is as expected with it.
        """
        return error_factor(*self._parts)

    @property
    def rescaled(self) -> np.ndarray:
        """Return chi2 with errors of the catalogue that are so much larger."""
        return _chi2(*self._parts, self.factor)

    @cached_property
    def _parts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the squares of the deviations, the shares, and the squares of the shift."""
        stars = self.stars
        shifts = np.zeros_like(stars.shares)
        if self.shift:
            inverse_root = stars.axes.transpose(0, 2, 1) @ stars.inverse_root
            shifts = self.shift**2 * np.sum(np.square(inverse_root), axis=2)
        return np.square(stars.along), stars.shares, shifts


def catalogue_chi2(
    rows: pd.DataFrame, shift: float = 0.0, *, chosen: np.ndarray | None = None
) -> CatalogueChi2:
    """Return the chi2 of the catalogue positions of stars.

    Parameters
    ----------
    rows : of `schema.SOURCES`
    shift : as of the result
    chosen : whether to take a row, shape (rows,); None for all
    """
    stars = against_catalogue(rows, chosen)
    return CatalogueChi2(rows["source_id"].to_numpy()[stars.place], stars, shift)


class AgainstCatalogue(NamedTuple):
    """Deviations of stars from the catalogue, in axes in which they are independent.

    Attributes
    ----------
    place : row of the stars in their table, shape (n,)
    along : deviations in units of the catalogue's errors, shape (n, 2)
    shares : of the catalogue's variance that the measurements remove, shape (n, 2)
    axes : columns are the axes, shape (n, 2, 2)
    inverse_root : takes displacements, mas, to units of the catalogue's errors, shape (n, 2, 2)
    """

    place: np.ndarray
    along: np.ndarray
    shares: np.ndarray
    axes: np.ndarray
    inverse_root: np.ndarray


def against_catalogue(rows: pd.DataFrame, chosen: np.ndarray | None = None) -> AgainstCatalogue:
    """Return the deviations of those stars from the catalogue that the measurements determine.

    Parameters
    ----------
    rows : of `schema.SOURCES`
    chosen : whether to take a row, shape (rows,); None for all
    """
    prior = covariance(rows, "prior_sigma_ra", "prior_sigma_dec", "prior_corr")
    marginal = covariance(rows, "sigma_ra_marginal", "sigma_dec_marginal", "corr_marginal")
    variances = [of_all[:, axis, axis] for of_all in (prior, marginal) for axis in (0, 1)]
    is_known = np.isfinite(variances).all(axis=0)
    place = np.flatnonzero(is_known if chosen is None else is_known & chosen)
    prior, marginal = prior[place], marginal[place]
    offset = np.stack(
        [rows[f"offset_{axis}"].to_numpy(dtype=float)[place] for axis in ("ra", "dec")], axis=1
    )
    inverse_root = _inverse_root(prior)
    share = np.eye(2) - inverse_root @ marginal @ inverse_root.transpose(0, 2, 1)
    shares, axes = _eigenvectors(share)
    scaled = (inverse_root @ offset[:, :, None])[:, :, 0]
    along = np.einsum("nik,ni->nk", axes, scaled)
    known = shares[:, 0] > _LEAST_SHARE
    return AgainstCatalogue(
        *(of_all[known] for of_all in (place, along, shares, axes, inverse_root))
    )


def _inverse_root(matrices: np.ndarray) -> np.ndarray:
    """Return the inverses of the lower Cholesky factors of matrices of shape (n, 2, 2)."""
    first, both, second = matrices[:, 0, 0], matrices[:, 0, 1], matrices[:, 1, 1]
    above = np.sqrt(first)
    below = np.sqrt(second - both**2 / first)
    left, none = -both / (first * below), np.zeros_like(both)
    return np.stack([1.0 / above, none, left, 1.0 / below], axis=-1).reshape(-1, 2, 2)


def _eigenvectors(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the eigenvalues, ascending, and eigenvectors of symmetric matrices of shape (n, 2, 2).

    As `numpy.linalg.eigh` does, six times as fast for many.
    """
    first, both, second = matrices[:, 0, 0], matrices[:, 0, 1], matrices[:, 1, 1]
    middle, half = 0.5 * (first + second), 0.5 * (first - second)
    radius, angle = np.hypot(half, both), 0.5 * np.arctan2(both, half)
    c, s = np.cos(angle), np.sin(angle)
    axes = np.stack([-s, c, c, s], axis=-1).reshape(-1, 2, 2)
    return np.stack([middle - radius, middle + radius], axis=-1), axes


def _chi2(along: np.ndarray, shares: np.ndarray, shifts: np.ndarray, factor: float) -> np.ndarray:
    """Return the chi2 of each star with errors of the catalogue that are larger by a factor.

    With an error f times as large, and a shift, the catalogue position minus the fit without it
    has the covariance (f^2 + e^2) P + M, where P + M = P (P - C)^-1 P. In units of the
    catalogue's errors it is 1 / s + f^2 + e^2 - 1 along an eigenvector of the share s of P that
    the measurements remove.

    Parameters
    ----------
    along : squares of the deviations from the catalogue along the eigenvectors, shape (n, 2)
    shares : s, shape (n, 2)
    shifts : e^2 along the eigenvectors, shape (n, 2)
    """
    first, second = (along / (shares + (factor**2 - 1.0 + shifts) * shares**2)).T
    return first + second


def error_factor(along: np.ndarray, shares: np.ndarray, shifts: np.ndarray) -> float:
    """Return the factor on the catalogue's errors for which the median chi2 is as expected.

    Parameters as in `_chi2`.
    """

    def excess(log_factor: float) -> float:
        chi2 = _chi2(along, shares, shifts, float(np.exp(log_factor)))
        return float(np.median(chi2)) - MEDIAN_CHI2

    if not len(along) or excess(0.0) <= 0.0:
        return 1.0
    most = float(np.log(_LARGEST_FACTOR))
    if excess(most) >= 0.0:
        return _LARGEST_FACTOR
    return float(np.exp(brentq(excess, 0.0, most, xtol=_ROUNDING)))


def covariance(rows: pd.DataFrame, first: str, second: str, correlation: str) -> np.ndarray:
    """Return covariances, mas^2, shape (n, 2, 2), from columns of sigmas and a correlation."""
    ra, dec, rho = (rows[name].to_numpy(dtype=float) for name in (first, second, correlation))
    return np.stack([ra**2, rho * ra * dec, rho * ra * dec, dec**2], axis=-1).reshape(-1, 2, 2)


def deviation_chance(result: FitResult, axis: str) -> tuple[float, float, float, float]:
    """Return the rms deviation of the references, as in the summary, and its chance.

    Parameters
    ----------
    axis : "ra" or "dec"

    Returns
    -------
    value, expected, scatter and the logarithm of the two-sided chance
    """
    summary = result.summary
    value = float(summary[f"normalised_deviation_{axis}"])
    expected = float(summary[f"expected_normalised_deviation_{axis}"])
    # Older results lack it.
    dof = float(summary.get(f"normalised_deviation_dof_{axis}", summary["n_reference"]))
    if not (np.isfinite(value) and expected > 0.0 and dof > 0.0):
        return value, expected, float("nan"), 0.0
    above = float(chdtrc(dof, dof * (value / expected) ** 2))
    chance = max(2.0 * min(above, 1.0 - above), 1e-300)
    return value, expected, expected / float(np.sqrt(2.0 * dof)), float(np.log(min(chance, 1.0)))
