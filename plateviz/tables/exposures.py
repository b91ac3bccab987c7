"""Measurements of the shown exposures and detectors, and the times of exposures."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from solver.data.result import FitResult
from solver.units import MINUTES_PER_DAY

ExposureKey = tuple[int, int]
"""field_id and plate_id."""


def is_shown(
    result: FitResult, exposures: Iterable[ExposureKey] | None, detector_id: int | None
) -> np.ndarray:
    """Return which measurements are of the shown exposures and of a detector, shape (n,).

    Parameters
    ----------
    exposures : the shown exposures; None for all
    detector_id : the detector, or None for all
    """
    keep = np.ones(len(result.residuals), dtype=bool)
    if exposures is not None:
        wanted = set(exposures)
        keys = result.exposures[["field_id", "plate_id"]].itertuples(index=False, name=None)
        keep &= np.array([key in wanted for key in keys], dtype=bool)[result.exposure_index]
    if detector_id is not None:
        keep &= result.residuals["detector_id"].to_numpy() == detector_id
    return keep


def minutes_since_first(exposures: pd.DataFrame) -> np.ndarray:
    """Return the time of each exposure since the first one of the orbit, min."""
    times = exposures["obstime"].to_numpy(dtype=float)
    return (times - times.min(initial=np.inf)) * MINUTES_PER_DAY
