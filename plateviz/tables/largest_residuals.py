"""Table of the largest residuals, of measurements and of whole sources, against chance."""

import numpy as np
import pandas as pd
from scipy.special import betaincinv, chdtrc, gammaln, xlogy

from plateviz.tables.chance import largest_chi2
from plateviz.tables.labels import exposure_labels, id_strings
from plateviz.tables.sources import chi2_per_dof
from solver.data.result import FitResult

MEASUREMENT, SOURCE = "measurement", "source"
_COMPLETE = 1_000
"""Number of the largest values that are all in the table."""
_THINNED = 300
# Of all values of a rank, 95 % are between these shares.
_LOW, _MIDDLE, _HIGH = 0.025, 0.5, 0.975


def largest_residuals(result: FitResult) -> pd.DataFrame:
    """Return the residuals in order of size, with the size that is expected of each rank.

    The squared standardised residual of a measurement, corrected for its leverage, is chi2 with
    two degrees of freedom. The sum over the measurements of a source, of two or more, has more
    of them: it is converted to the chi2 of two degrees of freedom that is as unlikely. The 1,000
    largest of each kind are all in the table, of the others a few hundred.

    Parameters
    ----------
    result : the fit

    Returns
    -------
    A row per value, the largest first: `kind` ("measurement" or "source"), `rank` (from 1),
    `chi` (root of chi2), `expected` (its median at this rank), `low`, `high` (95 % are between
    these), `level` (which the largest exceeds by chance in 1 %), `is_beyond`, `count` (of all
    values of the kind), `id`, `exposure` and `detector` (text, empty for a source), `n_obs` (1
    for a measurement), and `chi2_per_dof`
    """
    return pd.concat([_of_measurements(result), _of_sources(result)], ignore_index=True)


def _of_measurements(result: FitResult) -> pd.DataFrame:
    residuals = result.residuals
    chi2 = residuals["standardised_x"].to_numpy() ** 2 + residuals["standardised_y"].to_numpy() ** 2
    chosen, ranked = _ranked(chi2, MEASUREMENT)
    rows = residuals.iloc[chosen]
    return ranked.assign(
        id=id_strings(rows["source_id"]).to_numpy(),
        exposure=exposure_labels(rows).to_numpy(),
        detector=rows["detector_id"].astype(str).to_numpy(),
        n_obs=1,
        chi2_per_dof=0.5 * chi2[chosen],
    )


def _of_sources(result: FitResult) -> pd.DataFrame:
    # A source of one measurement has nothing that the measurement has not.
    sources = result.sources[result.sources["n_obs"] > 1]
    chi2, dof = sources["chi2"].to_numpy(), sources["dof"].to_numpy()
    chosen, ranked = _ranked(_equivalent_chi2(chi2, dof), SOURCE)
    rows = sources.iloc[chosen]
    return ranked.assign(
        id=id_strings(rows["source_id"]).to_numpy(),
        exposure="",
        detector="",
        n_obs=rows["n_obs"].to_numpy(),
        chi2_per_dof=chi2_per_dof(rows),
    )


def _ranked(chi2: np.ndarray, kind: str) -> tuple[np.ndarray, pd.DataFrame]:
    """Return the rows to keep, the largest first, and their ranks with what is expected."""
    known = np.flatnonzero(np.isfinite(chi2))
    descending = known[np.argsort(-chi2[known], kind="stable")]
    count = len(descending)
    rank = _kept_ranks(count)
    chosen = descending[rank - 1]
    chi = np.sqrt(chi2[chosen])
    level = np.sqrt(largest_chi2(max(count, 1)))
    # The probability of the value of a rank has a beta distribution.
    high, expected, low = (
        np.sqrt(-2.0 * np.log(betaincinv(rank, count - rank + 1.0, share)))
        for share in (_LOW, _MIDDLE, _HIGH)
    )
    return chosen, pd.DataFrame(
        {
            "kind": kind,
            "rank": rank,
            "chi": chi,
            "expected": expected,
            "low": low,
            "high": high,
            "level": level,
            "is_beyond": chi > level,
            "count": count,
        }
    )


def _kept_ranks(count: int) -> np.ndarray:
    if count <= _COMPLETE + _THINNED:
        return np.arange(1, count + 1)
    thinned = np.geomspace(_COMPLETE, count, _THINNED + 1).round()[1:].astype(np.int64)
    return np.unique(np.concatenate([np.arange(1, _COMPLETE + 1), thinned]))


def _equivalent_chi2(chi2: np.ndarray, dof: np.ndarray) -> np.ndarray:
    """Return the chi2 of two degrees of freedom that is as unlikely: -2 ln of its probability."""
    probability = chdtrc(dof, chi2)
    is_rounded_to_zero = probability <= 0.0
    found = -2.0 * np.log(np.where(is_rounded_to_zero, 1.0, probability))
    # First term of the expansion of the incomplete gamma function, far above its mean.
    a, z = 0.5 * dof[is_rounded_to_zero], 0.5 * chi2[is_rounded_to_zero]
    found[is_rounded_to_zero] = -2.0 * (xlogy(a, z) - z - np.log(z - a + 1.0) - gammaln(a))
    return found
