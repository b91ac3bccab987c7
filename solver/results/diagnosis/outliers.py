"""Which measurements are outliers."""

import numpy as np
from scipy.special import ndtri

# Sigmas beyond which a residual is an outlier: one good one in five hundred million is.
FAR = 6.0
# Median of the larger of two chi2 with one degree of freedom each.
_MEDIAN_OF_LARGER = float(ndtri(0.5 + 0.5 * np.sqrt(0.5))) ** 2


def are_outliers(squares: np.ndarray, exposure: np.ndarray) -> np.ndarray:
    """Return which measurements are far off, by the scatter of their exposure, which is robust.

    Parameters
    ----------
    squares : of the residual over its expected scatter, of the axis with the larger, shape (n,)
    exposure : of each measurement, ascending, shape (n,)
    """
    are_far = squares > FAR**2
    # An exposure that scatters by more has fewer of them, never more.
    for one in np.unique(exposure[are_far]):
        rows = slice(*np.searchsorted(exposure, [one, one + 1]))
        scale = max(float(np.median(squares[rows])) / _MEDIAN_OF_LARGER, 1.0)
        are_far[rows] = squares[rows] > FAR**2 * scale
    return are_far
