"""Residuals as they would be without some exposures, whose errors the positions carry."""

import numpy as np

from solver.results.diagnosis.rows import Camera, Rows


def without_exposures(
    rows: Rows, camera: Camera, variance: np.ndarray, left_out: np.ndarray
) -> Rows:
    """Return the residuals that a fit of the positions without some exposures would leave.

    All else stays as it was fitted. What such an exposure is off by, its sources have taken a
    share of, and have carried it into all other exposures.

    Parameters
    ----------
    variance : of the prior of each source along one axis, um^2
    left_out : indices of the exposures; the residuals of their rows are zero

    Returns
    -------
    The rows, those that are left out too, with other `residual`, `left` and `chi2`
    """
    is_out = np.isin(rows.exposure, left_out)
    n, used = len(variance), ~(is_out | rows.is_far)
    roll = camera.roll.take(rows.exposure)
    c, s = np.cos(roll), np.sin(roll)
    x, y = (rows.weight * is_out * along for along in rows.residual.T)
    pull = np.stack([np.bincount(rows.source, one, n) for one in (c * x - s * y, s * x + c * y)])
    before, after = (
        np.bincount(rows.source, rows.weight * kept, n) + 1.0 / variance for kept in (1.0, ~is_out)
    )
    ra, dec = (pull / after)[:, rows.source] * used
    shift = np.stack([c * ra + s * dec, c * dec - s * ra], axis=1)
    residual = (rows.residual + shift) * ~is_out[:, None]
    change = np.square(residual).sum(axis=1) - np.square(rows.residual).sum(axis=1)
    taken = rows.weight * (1.0 / after - 1.0 / before)[rows.source] * used
    return rows._replace(
        residual=residual,
        left=np.clip(rows.left - taken, 0.0, 1.0),
        chi2=np.maximum(rows.chi2 + rows.weight * change * used, 0.0),
    )
