"""The selected exposures and detectors, as lists with their values in a solution."""

from collections.abc import Set as AbstractSet

import numpy as np
import pandas as pd

from plateviz.tables.exposures import ExposureKey, minutes_since_first
from plateviz.tables.headings import SELECTED_DETECTORS, SELECTED_EXPOSURES
from plateviz.tables.sources import chi2_per_dof
from solver.data.result import FitResult

_STANDARDISED = ("standardised_x", "standardised_y")


def selected_exposures(
    selected: AbstractSet[ExposureKey], result: FitResult | None
) -> pd.DataFrame:
    """Return a row per selected exposure of the solution, in order.

    Parameters
    ----------
    selected : (field_id, plate_id)
    result : the solution on the screen, or None

    Returns
    -------
    `field_id`, `plate_id`, `minutes` (since the first exposure), `n_obs` and `chi2_per_dof`
    """
    if result is None:
        return pd.DataFrame(columns=list(SELECTED_EXPOSURES))
    table = result.exposures.assign(
        minutes=minutes_since_first(result.exposures), chi2_per_dof=chi2_per_dof(result.exposures)
    )
    keys = table[["field_id", "plate_id"]].itertuples(index=False, name=None)
    is_selected = np.array([key in selected for key in keys], dtype=bool)
    return table.loc[is_selected, list(SELECTED_EXPOSURES)].reset_index(drop=True)


def selected_detectors(selected: AbstractSet[int], result: FitResult | None) -> pd.DataFrame:
    """Return a row per selected detector that the solution has measurements of.

    Parameters
    ----------
    selected : ids
    result : the solution on the screen, or None

    Returns
    -------
    `detector_id`, `n_obs`, and the rms of the residuals over their sigmas, corrected for leverage,
    `rms_x` and `rms_y`
    """
    if result is None:
        return pd.DataFrame(columns=list(SELECTED_DETECTORS))
    rows = result.residuals
    rows = rows.loc[rows["detector_id"].isin(selected), ["detector_id", *_STANDARDISED]]
    groups = rows.groupby("detector_id")
    rms = np.sqrt(groups.agg(lambda values: np.mean(np.square(values))))
    rms.columns = ["rms_x", "rms_y"]
    return rms.assign(n_obs=groups.size()).reset_index()[list(SELECTED_DETECTORS)]
