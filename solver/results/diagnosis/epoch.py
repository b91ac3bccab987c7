"""A test of the epoch: whether stars are where the catalogue has them at another time.

Where all times are wrong alike, or the epoch of the catalogue is, each star is off by its proper
motion times the same interval. The frame takes up what all motions have in common.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import chdtri

from solver.results.diagnosis.references import against_catalogue, covariance, error_factor
from solver.units import DAYS_PER_JULIAN_YEAR

_ROUNDS = 4
# Stars whose chi2, with two degrees of freedom, chance makes less often are left out: binaries.
_RARE = 1e-4
_FEWEST_STARS = 10


class EpochOffset(NamedTuple):
    """How much later the stars are measured than the times of the exposures say.

    Attributes
    ----------
    days : less than zero where the recorded times are too late; NaN where no motion is known
    sigma : its uncertainty, days
    common : shift of all stars in ra cos(dec) and dec, by which the frame follows these motions,
        mas
    """

    days: float
    sigma: float
    common: tuple[float, float] = (0.0, 0.0)

    def moved(self, rows: pd.DataFrame) -> pd.DataFrame:
        """Return `schema.SOURCES` with the offsets from where the stars are at that other time.

        The estimate follows the prior by C P^-1 of the way, with P and C the covariances of
        catalogue and estimate.
        """
        motion = rows[["prior_pmra", "prior_pmdec"]].fillna(0.0).to_numpy(dtype=float)
        prior = covariance(rows, "prior_sigma_ra", "prior_sigma_dec", "prior_corr")
        marginal = covariance(rows, "sigma_ra_marginal", "sigma_dec_marginal", "corr_marginal")
        way = ((self.days / DAYS_PER_JULIAN_YEAR) * motion + self.common)[:, :, None]
        ra, dec = (way - marginal @ np.linalg.solve(prior, way))[:, :, 0].T
        return rows.assign(offset_ra=rows["offset_ra"] - ra, offset_dec=rows["offset_dec"] - dec)


def epoch_offset(rows: pd.DataFrame, shift: float = 0.0) -> EpochOffset:
    """Return how much later the stars are measured than the times of the exposures say.

    It is the weighted mean over the reference stars, each against the fit without its own
    catalogue position. The catalogue's errors are those that the other deviations have.

    Parameters
    ----------
    rows : of `schema.SOURCES`; results of older versions lack the proper motions
    shift : of the fitted positions by an error of the model, rms along each axis, mas
    """
    unknown = EpochOffset(float("nan"), float("nan"))
    if "prior_pmra" not in rows:
        return unknown
    motion = np.stack([rows[f"prior_pm{axis}"].to_numpy(float) for axis in ("ra", "dec")], axis=1)
    known = np.isfinite(motion).all(axis=1)
    stars = against_catalogue(rows, known & rows["is_reference"].to_numpy(bool))
    motion = motion[stars.place] / DAYS_PER_JULIAN_YEAR
    if len(motion) < _FEWEST_STARS or not np.ptp(motion, axis=0).any():
        return unknown
    to_axes = stars.axes.transpose(0, 2, 1) @ stars.inverse_root
    # The motion of each star, and a shift of all of them along either axis.
    design = np.concatenate([to_axes @ motion[:, :, None], to_axes], axis=2)
    shifts = shift**2 * np.sum(np.square(to_axes), axis=2)
    fitted, factor, is_used = np.zeros_like(stars.along), 0.0, np.zeros(len(motion), dtype=bool)
    for _ in range(_ROUNDS):
        left, before = stars.along - fitted, (factor, is_used)
        factor = error_factor(np.square(left), stars.shares, shifts)
        variance = stars.shares + (factor**2 - 1.0 + shifts) * stars.shares**2
        is_used = np.sum(np.square(left) / variance, axis=1) < chdtri(2.0, _RARE)
        if factor == before[0] and np.array_equal(is_used, before[1]):
            # The same stars with the same errors give the same again.
            break
        by_share = stars.shares[:, :, None] * design
        weighted = (by_share / variance[:, :, None])[is_used].reshape(-1, 3)
        covariance = np.linalg.pinv(weighted.T @ by_share[is_used].reshape(-1, 3))
        values = covariance @ (weighted.T @ stars.along[is_used].ravel())
        fitted = by_share @ values
    days, *common = values.tolist()
    return EpochOffset(days, float(np.sqrt(covariance[0, 0])), tuple(common))
