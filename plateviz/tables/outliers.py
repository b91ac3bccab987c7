"""Table of the measurements that a robust fit has removed as outliers."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import exposure_labels, id_strings
from solver.data.result import FitResult

# Sigmas of both measurements within which one is where the other should be.
_NEAR = 6.0


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


def outlier_sentences(result: FitResult) -> list[str]:
    """Return a sentence on the outliers of a robust fit; none if there are none."""
    if result.outliers is None or result.outliers.empty:
        return []
    words = f"Measurements removed as outliers: {len(result.outliers):,}."
    count = int(swapped(result.outliers).sum())
    if count:
        words += f" {count:,} of them have each other's identification, in pairs."
    return [words]


def swapped(outliers: pd.DataFrame) -> np.ndarray:
    """Return which outliers are where another outlier of the same exposure should be.

    The two have each other's identification: each is at the other's predicted position.

    Parameters
    ----------
    outliers : `schema.OUTLIERS`
    """
    is_swapped = np.zeros(len(outliers), dtype=bool)
    for _, rows in outliers.reset_index(drop=True).groupby(["field_id", "plate_id", "detector_id"]):
        at = rows[["nx", "ny"]].to_numpy()
        residual = rows[["residual_x", "residual_y"]].to_numpy()
        # Uncertainty of one coordinate; the distance is that of both.
        sigma = np.hypot(*residual.T) / np.maximum(rows["distance"].to_numpy(), 1e-300)
        apart = at[:, None] - (at - residual)[None]
        is_there = np.hypot(apart[..., 0], apart[..., 1]) < _NEAR * (sigma[:, None] + sigma)
        np.fill_diagonal(is_there, False)
        is_swapped[rows.index] = (is_there & is_there.T).any(axis=1)
    return is_swapped
