"""Table of the reference sources without their own catalogue position: pull and influence.

The estimate of a reference source has the covariance C and the offset o from its catalogue
position, whose covariance is P. Without this catalogue position the source would be elsewhere: at
x, with the covariance L, where L^-1 = C^-1 - P^-1, because what the measurements say about the
source is independent of what its catalogue position says. All else that is fitted is integrated
out in C, so that x and L are those of a fit without the position. With M = P - C,

    catalogue minus x    -P M^-1 o, with the covariance P + L = P M^-1 P
    estimate minus x     -C M^-1 o

and the chi2 of the first, with two degrees of freedom, is o' M^-1 o. This is exact where the
model is linear.
"""

import numpy as np
import pandas as pd

from plateviz.tables.chance import largest_chi2
from plateviz.tables.labels import id_strings
from solver.data.result import FitResult
from solver.results.diagnosis.references import covariance

_AXES = ("ra", "dec")
# Below this share of the catalogue's variance that the measurements remove, they say nothing of
# the source but rounding errors.
_LEAST_SHARE = 1e-9


def reference_influence(result: FitResult) -> pd.DataFrame:
    """Return the catalogue of each reference source against the fit without it.

    Parameters
    ----------
    result : the fit

    Returns
    -------
    A row per reference source, in ascending id: `id`, `n_obs`, catalogue minus the position
    without it in mas: `residual_ra` (ra cos(dec)), `residual_dec`; these over their uncertainty:
    `pull_ra`, `pull_dec`; `pull` (root of their chi2 with two degrees of freedom), `influence`
    (shift of the estimate by its catalogue position, in sigmas of the estimate), `shift_mas`
    (the length of that), `share` (of the catalogue in the estimate, 0 to 1), `level` (of the
    pull, which the largest exceeds by chance in 1 %) and `is_beyond`; NaN and False where the
    measurements do not determine the position without its catalogue
    """
    rows = result.sources[result.sources["is_reference"]].sort_values("source_id")
    prior = covariance(rows, "prior_sigma_ra", "prior_sigma_dec", "prior_corr")
    posterior = covariance(rows, "sigma_ra_marginal", "sigma_dec_marginal", "corr_marginal")
    offset = rows[[f"offset_{axis}" for axis in _AXES]].to_numpy(dtype=float)
    # o' M^-1 in the unit of the prior, in which M has the measurements' shares as eigenvalues.
    root = np.linalg.cholesky(prior)
    inverse_root = np.linalg.inv(root)
    share = np.eye(2) - inverse_root @ posterior @ inverse_root.transpose(0, 2, 1)
    is_known = np.linalg.eigvalsh(share)[:, 0] > _LEAST_SHARE
    share[~is_known] = np.nan
    scaled = (inverse_root @ offset[:, :, None])[:, :, 0]
    weighted = _times(np.linalg.inv(share), scaled)
    residual = -_times(root, weighted)
    scatter = root @ np.linalg.inv(share) @ root.transpose(0, 2, 1)
    shift = -_times(posterior @ inverse_root.transpose(0, 2, 1), weighted)
    pull = np.sqrt(np.sum(scaled * weighted, axis=1))
    influence = np.sqrt(np.sum(shift * _times(np.linalg.inv(posterior), shift), axis=1))
    level = np.sqrt(largest_chi2(max(int(is_known.sum()), 1)))
    sigma = np.sqrt(np.diagonal(scatter, axis1=1, axis2=2))
    return pd.DataFrame(
        {
            "id": id_strings(rows["source_id"]),
            "n_obs": rows["n_obs"],
            **{f"residual_{axis}": residual[:, i] for i, axis in enumerate(_AXES)},
            **{f"pull_{axis}": residual[:, i] / sigma[:, i] for i, axis in enumerate(_AXES)},
            "pull": pull,
            "influence": influence,
            "shift_mas": np.hypot(*shift.T),
            "share": 1.0 - 0.5 * np.trace(share, axis1=1, axis2=2),
            "level": level,
            "is_beyond": pull > level,
        }
    ).reset_index(drop=True)


def _times(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.einsum("nij,nj->ni", matrices, vectors)
