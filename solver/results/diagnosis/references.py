"""Tests of the reference stars: the catalogue against the measurements.

The estimate minus the catalogue position of a star has the covariance P - C, with P of the
catalogue and C of the estimate. Its chi2 is that of the catalogue position against the fit
without it (leave one out), with two degrees of freedom.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import chdtrc

from solver.data.result import FitResult

# Below this share of the catalogue's variance that the measurements remove, they say nothing.
_LEAST_SHARE = 1e-6


class ReferenceChi2(NamedTuple):
    """The catalogue position of each reference star against the fit without it.

    Attributes
    ----------
    source_id : of the stars that the measurements determine, shape (n,)
    chi2 : with two degrees of freedom, shape (n,)
    """

    source_id: np.ndarray
    chi2: np.ndarray


def reference_chi2(sources: pd.DataFrame) -> ReferenceChi2:
    """Return the chi2 of each reference star.

    Parameters
    ----------
    sources : `schema.SOURCES`
    """
    rows = sources[sources["is_reference"].to_numpy(bool)]
    prior = covariance(rows, "prior_sigma_ra", "prior_sigma_dec", "prior_corr")
    marginal = covariance(rows, "sigma_ra_marginal", "sigma_dec_marginal", "corr_marginal")
    offset = rows[["offset_ra", "offset_dec"]].to_numpy(dtype=float)
    inverse_root = np.linalg.inv(np.linalg.cholesky(prior))
    share = np.eye(2) - inverse_root @ marginal @ inverse_root.transpose(0, 2, 1)
    known = np.linalg.eigvalsh(share)[:, 0] > _LEAST_SHARE
    scaled = (inverse_root[known] @ offset[known, :, None])[:, :, 0]
    solved = np.linalg.solve(share[known], scaled[:, :, None])[:, :, 0]
    chi2 = np.einsum("ni,ni->n", scaled, solved)
    return ReferenceChi2(rows["source_id"].to_numpy()[known], chi2)


def covariance(rows: pd.DataFrame, first: str, second: str, correlation: str) -> np.ndarray:
    """Return covariances from the columns of two sigmas and a correlation, shape (n, 2, 2)."""
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
