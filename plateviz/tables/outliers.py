"""Table of the measurements that a robust fit has removed as outliers."""

import pandas as pd

from plateviz.tables.labels import exposure_labels, id_strings
from solver.data.result import FitResult


def outlier_list(result: FitResult) -> pd.DataFrame | None:
    """Return the outliers for display, the farthest first.

    Parameters
    ----------
    result : the fit

    Returns
    -------
    `exposure`, `detector`, `source`, the residuals in pixels, and in sigmas the distance of
    the measurement from its prediction and the shift of its source that it would cause; None
    if the fit did not search for outliers
    """
    found = result.outliers
    if found is None:
        return None
    return pd.DataFrame(
        {
            "source": id_strings(found["source_id"]),
            "exposure": exposure_labels(found),
            "detector": found["detector_id"],
            "residual x [pix]": found["residual_x"],
            "residual y [pix]": found["residual_y"],
            "distance [σ]": found["distance"].round(1),
            "would move α by [σ]": found["shift_ra"].round(2),
            "would move δ by [σ]": found["shift_dec"].round(2),
        }
    )
