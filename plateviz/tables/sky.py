"""Directions on the sky: safe differences, and the focal plane mapped back to the sky."""

import numpy as np
import pandas as pd

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
    deg, with the cosine of `dec`; differences are taken before anything is scaled
    """
    difference = np.asarray(ra) - ra_0
    # Whole turns are removed by subtraction, which keeps a difference near zero exact;
    # the usual (x + 180) % 360 - 180 would round it to the precision of 180 deg.
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
    """Return the direction of the mean of unit vectors, deg; (0, 0) for no direction."""
    if len(ra) == 0:
        return 0.0, 0.0
    mean = _unit_vectors(np.radians(ra), np.radians(dec)).mean(axis=0)
    return _direction(mean)


def sky_of_focal_plane(ideal_um: np.ndarray, pointing: pd.Series) -> tuple[np.ndarray, np.ndarray]:
    """Return the directions seen at places of the ideal focal plane of one exposure.

    The inverse of Eq. (method:ideal) and of the gnomonic Eq. (method:projection).

    Parameters
    ----------
    ideal_um : undistorted focal-plane x and y, um, shape (n, 2)
    pointing : `pointing_ra`, `pointing_dec`, `position_angle` in deg, `focal_length` in um

    Returns
    -------
    ra, dec : deg, shape (n,)
    """
    angle = np.radians(pointing["position_angle"])
    c, s = np.cos(angle), np.sin(angle)
    # Rows times this matrix apply the transpose of the rotation of Eq. (method:ideal).
    minus_xi, eta = (ideal_um / pointing["focal_length"] @ np.array([(c, s), (-s, c)])).T
    ra, dec = np.radians(pointing["pointing_ra"]), np.radians(pointing["pointing_dec"])
    axis = _unit_vectors(ra, dec)
    east = np.array([-np.sin(ra), np.cos(ra), 0.0])
    north = np.cross(axis, east)
    return _direction(axis - np.outer(minus_xi, east) + np.outer(eta, north))


def _unit_vectors(ra: np.ndarray, dec: np.ndarray) -> np.ndarray:
    return np.stack([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)], axis=-1)


def _direction(vectors: np.ndarray) -> tuple:
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.degrees(np.arctan2(y, x)) % 360.0, np.degrees(np.arctan2(z, np.hypot(x, y)))
