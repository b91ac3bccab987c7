"""Directions as unit vectors: local frames on the sky, and the inverse of the gnomonic projection.

NumPy only, so that code which must not load JAX can use it.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from solver.units import MAS_PER_DEG

Degrees = ArrayLike | float


def tangent_frame(
    ra_deg: Float[np.ndarray, " n"], dec_deg: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "n 3 3"]:
    """Return the local frames (direction, east, north) at sky positions.

    Parameters
    ----------
    ra_deg, dec_deg : deg

    Returns
    -------
    unit vectors along the second axis, in the order direction, east, north
    """
    a, d = np.radians(ra_deg), np.radians(dec_deg)
    ca, sa, cd, sd, zero = np.cos(a), np.sin(a), np.cos(d), np.sin(d), np.zeros_like(a)
    rows = [(cd * ca, cd * sa, sd), (-sa, ca, zero), (-sd * ca, -sd * sa, cd)]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def displaced(
    frame: Float[np.ndarray, "n 3 3"], east: Float[np.ndarray, " n"], north: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "n 3"]:
    """Return unit vectors displaced in the tangent plane; as `projection.displace`, in NumPy.

    Outside of a compiled program JAX would compile each operation for each number of vectors.

    Parameters
    ----------
    frame : as from `tangent_frame`
    east, north : rad
    """
    moved = frame[:, 0] + east[:, None] * frame[:, 1] + north[:, None] * frame[:, 2]
    return moved / np.linalg.norm(moved, axis=-1, keepdims=True)


def unproject(
    ideal_um: Float[np.ndarray, "n 2"],
    frame: Float[np.ndarray, "3 3"],
    position_angle: float,
    focal_length: float,
) -> Float[np.ndarray, "n 3"]:
    """Return the directions of positions on the ideal focal plane of one exposure.

    The inverse of `projection.project`, Eqs. (method:projection) and (method:ideal):
    the pointing plus x and y along the focal plane's axes, in focal lengths.

    Parameters
    ----------
    ideal_um : x and y, um, origin on the optical axis
    frame : of the pointing, as from `tangent_frame`
    position_angle : rad
    focal_length : um

    Returns
    -------
    vectors of length one or more
    """
    c, s = np.cos(position_angle), np.sin(position_angle)
    axes = np.array([(-c, s), (s, c)]) @ frame[1:]
    return frame[0] + ideal_um / focal_length @ axes


def mean_direction(
    ra_deg: Float[np.ndarray, " n"], dec_deg: Float[np.ndarray, " n"]
) -> tuple[float, float]:
    """Return right ascension and declination of the mean of some directions, deg; 0 of none."""
    if len(ra_deg) == 0:
        return 0.0, 0.0
    x, y, z = tangent_frame(ra_deg, dec_deg)[:, 0].mean(axis=0)
    ra, dec = np.degrees([np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))]).tolist()
    return ra % 360.0, dec


def places_about(
    centre: tuple[float, float], ra_deg: Float[np.ndarray, " n"], dec_deg: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "n 2"]:
    """Return the places of directions in the plane tangent at `centre`, deg to East and North."""
    axes = tangent_frame(np.array([centre[0]]), np.array([centre[1]]))[0]
    along, east, north = (tangent_frame(ra_deg, dec_deg)[:, 0] @ axes.T).T
    return np.degrees(np.stack([east, north], axis=1) / along[:, None])


def vectors_about(
    centre: tuple[float, float],
    ra_deg: Float[np.ndarray, " n"],
    dec_deg: Float[np.ndarray, " n"],
    east: Float[np.ndarray, " n"],
    north: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n 2"]:
    """Return small vectors at directions along East and North of `centre`, in their unit.

    East turns across a field, near a pole by as much as the right ascension.

    Parameters
    ----------
    east, north : along East and North of each direction
    """
    axes = tangent_frame(np.array([centre[0]]), np.array([centre[1]]))[0]
    frames = tangent_frame(ra_deg, dec_deg)
    vectors = east[:, None] * frames[:, 1] + north[:, None] * frames[:, 2]
    return vectors @ axes[1:].T


def offsets_deg(
    ra: Degrees, dec: Degrees, ra_0: Degrees, dec_0: Degrees
) -> tuple[np.ndarray, np.ndarray]:
    """Return the offsets in ra cos(dec) and dec of positions from an origin.

    Parameters
    ----------
    ra, dec, ra_0, dec_0 : deg; the right ascensions may lie on both sides of 0

    Returns
    -------
    deg, with the cosine of `dec`; the differences are taken before they are scaled
    """
    difference = np.atleast_1d(np.asarray(ra, dtype=float)) - np.asarray(ra_0, dtype=float)
    # Subtracting whole turns keeps a difference near zero exact; the usual
    # (x + 180) % 360 - 180 would round it to the precision of 180 deg.
    difference = difference - 360.0 * np.round(difference / 360.0)
    north = np.atleast_1d(np.asarray(dec, dtype=float))
    return difference * np.cos(np.radians(north)), north - np.asarray(dec_0, dtype=float)


def offsets_mas(
    ra: Degrees, dec: Degrees, ra_0: Degrees, dec_0: Degrees
) -> tuple[np.ndarray, np.ndarray]:
    """Return the offsets of `offsets_deg` in mas."""
    d_ra, d_dec = offsets_deg(ra, dec, ra_0, dec_0)
    return d_ra * MAS_PER_DEG, d_dec * MAS_PER_DEG
