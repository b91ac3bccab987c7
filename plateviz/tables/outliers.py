"""Table of the measurements that a robust fit has removed as outliers."""

import numpy as np
import pandas as pd

from plateviz.tables.labels import exposure_labels, id_strings
from solver.data.result import FitResult

# Sigmas of both measurements within which one is where the other should be.
_NEAR = 6.0
# Column of the source whose measurement has the identification of this one.
EXCHANGED = "identification exchanged with"


def outlier_list(result: FitResult) -> pd.DataFrame | None:
    """Return the outliers for display, the farthest first.

    Parameters
    ----------
    result : the fit

    Returns
    -------
    `source`, `exposure`, `detector`, the source with which its identification is exchanged (empty
    for a plain outlier), the residuals in pixels, and in sigmas the distance of the measurement
    from its prediction and the shift of its source that it would cause; None if the fit did not
    search for outliers
    """
    found = result.outliers
    if found is None:
        return None
    sources, other = id_strings(found["source_id"]), swapped_with(found)
    exchanged = np.full(len(found), "", dtype=object)
    exchanged[other >= 0] = sources.to_numpy()[other[other >= 0]]
    return pd.DataFrame(
        {
            "source": sources,
            "exposure": exposure_labels(found),
            "detector": found["detector_id"],
            EXCHANGED: exchanged,
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
    count = int((swapped_with(result.outliers) >= 0).sum())
    if count:
        words += f" {count:,} of them have each other's identification, in pairs."
    return [words]


def swapped_with(outliers: pd.DataFrame) -> np.ndarray:
    """Return with which other outlier of the same exposure each one is exchanged.

    The two have each other's identification: each is at the other's predicted position.

    Parameters
    ----------
    outliers : `schema.OUTLIERS`

    Returns
    -------
    Row number of the other one, -1 where there is none; shape (n,)
    """
    other = np.full(len(outliers), -1)
    for _, rows in outliers.reset_index(drop=True).groupby(["field_id", "plate_id", "detector_id"]):
        at = rows[["nx", "ny"]].to_numpy()
        residual = rows[["residual_x", "residual_y"]].to_numpy()
        # Uncertainty of one coordinate; the distance is that of both.
        sigma = np.hypot(*residual.T) / np.maximum(rows["distance"].to_numpy(), 1e-300)
        apart = at[:, None] - (at - residual)[None]
        sigmas = np.hypot(apart[..., 0], apart[..., 1]) / (sigma[:, None] + sigma)
        farther = np.maximum(sigmas, sigmas.T)
        np.fill_diagonal(farther, np.inf)
        nearest, number = farther.argmin(axis=1), np.arange(len(rows))
        # Of several that are near one another, only two can be a pair.
        is_pair = (farther[number, nearest] < _NEAR) & (nearest[nearest] == number)
        other[rows.index[is_pair]] = rows.index[nearest[is_pair]]
    return other
