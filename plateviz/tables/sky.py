"""Offsets between sky positions, and sky positions of points on the focal plane."""

import numpy as np
import pandas as pd

from solver.model.astrometry import sky_position
from solver.model.directions import tangent_frame, unproject
from solver.units import MAS_PER_DEG

ARCMIN_PER_DEG = 60.0


def offsets_deg(
    ra: np.ndarray, dec: np.ndarray, ra_0: np.ndarray | float, dec_0: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the offsets in ra cos(dec) and dec of positions from an origin.

    Parameters
    ----------
    ra, dec, ra_0, dec_0 : deg; the right ascensions may lie on both sides of 0

    Returns
    -------
    deg, with the cosine of `dec`; the differences are taken before they are scaled
    """
    difference = np.asarray(ra) - ra_0
    # Subtracting whole turns keeps a difference near zero exact; the usual
    # (x + 180) % 360 - 180 would round it to the precision of 180 deg.
    difference = difference - 360.0 * np.round(difference / 360.0)
    return difference * np.cos(np.radians(dec)), np.asarray(dec) - dec_0


def offsets_mas(
    ra: np.ndarray, dec: np.ndarray, ra_0: np.ndarray | float, dec_0: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the offsets of `offsets_deg` in mas."""
    d_ra, d_dec = offsets_deg(ra, dec, ra_0, dec_0)
    return d_ra * MAS_PER_DEG, d_dec * MAS_PER_DEG


def offsets_arcmin(
    ra: np.ndarray, dec: np.ndarray, ra_0: np.ndarray | float, dec_0: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the offsets of `offsets_deg` in arcmin."""
    d_ra, d_dec = offsets_deg(ra, dec, ra_0, dec_0)
    return d_ra * ARCMIN_PER_DEG, d_dec * ARCMIN_PER_DEG


def mean_direction(ra: np.ndarray, dec: np.ndarray) -> tuple[float, float]:
    """Return the direction of the mean unit vector, deg; (0, 0) for empty arrays."""
    if len(ra) == 0:
        return 0.0, 0.0
    mean = tangent_frame(ra, dec)[:, 0].mean(axis=0, keepdims=True)
    return tuple(angle.item() for angle in sky_position(mean))


def sky_of_focal_plane(ideal_um: np.ndarray, pointing: pd.Series) -> tuple[np.ndarray, np.ndarray]:
    """Return the sky positions of points on the ideal focal plane of one exposure.

    Parameters
    ----------
    ideal_um : undistorted focal-plane x and y, um, shape (n, 2)
    pointing : `pointing_ra`, `pointing_dec`, `position_angle` in deg, `focal_length` in um

    Returns
    -------
    ra, dec : deg, shape (n,)
    """
    place = [np.array([pointing[f"pointing_{axis}"]]) for axis in ("ra", "dec")]
    angle, focal_length = np.radians(pointing["position_angle"]), pointing["focal_length"]
    return sky_position(unproject(ideal_um, tangent_frame(*place)[0], angle, focal_length))
