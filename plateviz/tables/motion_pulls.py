"""Table of the pulls of the fitted motions: fitted minus true over sigma."""

import numpy as np
import pandas as pd

from plateviz.tables.histogram import pull_bins
from solver.data.survey_schema import MOTION_PARAMETERS

LEAST_ORBITS = 40
CHI2 = "chi2"


def motion_pulls(motions: pd.DataFrame, *, least_orbits: int = LEAST_ORBITS) -> pd.DataFrame:
    """Return the histograms of the pulls of the motion fits of the non-reference sources.

    Parameters
    ----------
    motions : `survey_schema.MOTIONS`; artificial sources count as non-reference here
    least_orbits : minimum number of orbits that measured a source

    Returns
    -------
    A row per parameter and bin: `parameter` (of `survey_schema.MOTION_PARAMETERS` where there
    is a truth, and "chi2": (chi2 - dof) / sqrt(2 dof) of the motion fit), `least_orbits` and
    the columns of `tables.pull_bins`; no rows without pulls
    """
    chosen = motions[~motions["is_reference"] & (motions["n_orbits"] >= least_orbits)]
    with_dof = chosen[chosen["dof"] > 0]
    departure = (with_dof["chi2"] - with_dof["dof"]) / np.sqrt(2.0 * with_dof["dof"])
    values = {name: chosen[f"pull_{name}"] for name in MOTION_PARAMETERS} | {CHI2: departure}
    frames = [
        pull_bins(pulls).assign(parameter=name, least_orbits=least_orbits)
        for name, pulls in values.items()
        if pulls.notna().any()
    ]
    if not frames:
        return pull_bins(departure).assign(parameter="", least_orbits=least_orbits).head(0)
    return pd.concat(frames, ignore_index=True)
