"""Table of the quality of fit of each orbit of a run against time."""

import numpy as np
import pandas as pd

from solver.model.apparent_motion import julian_year


def orbit_health(orbits: pd.DataFrame) -> pd.DataFrame:
    """Return the quality of fit of each orbit.

    Parameters
    ----------
    orbits : `survey_schema.RUN_ORBITS`

    Returns
    -------
    A row per orbit in order of id: `orbit_id`, `state` ("complete", "not converged", "failed"
    or "missing"), `message`, `year` (Julian; interpolated for an orbit without an epoch),
    `chi2_per_dof`, `expected_sd` = sqrt(2 / dof), `z` = (chi2_per_dof - 1) / expected_sd,
    and the normalised deviations of the reference sources `deviation_ra`, `deviation_dec` with
    their expectations `expected_ra`, `expected_dec`
    """
    rows = orbits.sort_values("orbit_id", kind="stable").reset_index(drop=True)
    scatter = np.sqrt(2.0 / rows["dof"])
    is_complete = rows["status"] == "complete"
    table = pd.DataFrame(
        {
            "orbit_id": rows["orbit_id"],
            "state": rows["status"].where(~is_complete | (rows["converged"] == 1), "not converged"),
            "message": rows["message"],
            "year": _interpolated_years(rows),
            "chi2_per_dof": rows["chi2_per_dof"],
            "expected_sd": scatter,
            "z": (rows["chi2_per_dof"] - 1.0) / scatter,
        }
    )
    for axis in ("ra", "dec"):
        table[f"deviation_{axis}"] = rows[f"normalised_deviation_{axis}"]
        table[f"expected_{axis}"] = rows[f"expected_normalised_deviation_{axis}"]
    return table


def _interpolated_years(rows: pd.DataFrame) -> np.ndarray:
    """Return the Julian years, interpolated in orbit number where a failed orbit has none."""
    year, order = julian_year(rows["epoch"]), rows["orbit_id"].to_numpy(dtype=float)
    known = np.isfinite(year)
    return np.interp(order, order[known], year[known]) if known.any() else year
