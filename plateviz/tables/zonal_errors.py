"""Table of the smooth errors of the catalogue that the orbits of a run show together."""

from typing import NamedTuple

import numpy as np
import pandas as pd

# Places along the longer side of the area.
_PLACES = 9


def zonal_errors(zonal: pd.DataFrame) -> pd.DataFrame:
    """Return the most likely field of smooth errors, on a grid over the area of the sources.

    What the orbits cannot show, a common shift among it, is not in the field, and what they show
    badly is nearly zero.

    Parameters
    ----------
    zonal : `run_schema.ZONAL_FIELD`

    Returns
    -------
    A row per place: `east_deg`, `north_deg` (from the centre), `error_ra_mas`, `error_dec_mas`
    (catalogue minus sky), `sigma_ra_mas`, `sigma_dec_mas` (scatter of these values by chance);
    without rows if the run has not been tested
    """
    if zonal.empty:
        return pd.DataFrame()
    half = zonal[["half_ra", "half_dec"]].iloc[0].to_numpy(float)
    counts = np.maximum(np.round(_PLACES * half / half.max()).astype(int), 2)
    # In the middle of equal cells, so that those at the edge have room for their arrows.
    along = [
        size * (2.0 * np.arange(n) + 1.0 - n) / n for size, n in zip(half, counts, strict=True)
    ]
    east, north = (places.ravel() for places in np.meshgrid(*along))
    table = pd.DataFrame({"east_deg": east, "north_deg": north})
    chance = [name for name in zonal.columns if name.startswith("scatter_")]
    for axis, rows in zonal.groupby("axis", sort=False):
        degrees = rows[["degree_ra", "degree_dec"]].to_numpy(int)
        monomials = np.stack([east**i * north**j for i, j in degrees], axis=-1)
        table[f"error_{axis}_mas"] = monomials @ rows["coefficient"].to_numpy(float)
        parts = monomials @ rows[chance].to_numpy(float)
        table[f"sigma_{axis}_mas"] = np.sqrt(np.sum(parts**2, axis=-1))
    return table


class ZonalStatistics(NamedTuple):
    """Summary of `run_schema.ZONAL_FIELD`.

    Attributes
    ----------
    chi2, dof, scatter : of the test, and its mean and standard deviation by chance
    rms_mas : of the field along one axis, by the excess of chi2; 0 if there is none
    typical_mas : rms of a field that would be seen in half of all such runs
    """

    chi2: float
    dof: float
    scatter: float
    rms_mas: float
    typical_mas: float


def zonal_statistics(zonal: pd.DataFrame) -> ZonalStatistics:
    """Return the summary of `run_schema.ZONAL_FIELD` with rows."""
    chi2, dof, rms, typical = (
        float(zonal[name].iloc[0]) for name in ("chi2", "dof", "rms", "typical")
    )
    return ZonalStatistics(chi2, dof, float(np.sqrt(2.0 * dof)), rms, typical)
