"""Galactic coordinates to ICRS and back, for positions, position angles and motions.

The Galactic frame is that of the Hipparcos catalogue, which Gaia also uses. The schedule
of the exposures uses it; all later steps use ICRS.
"""

import erfa
import numpy as np
from jaxtyping import Float


def galactic_to_icrs(
    l_deg: Float[np.ndarray, " n"], b_deg: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return right ascension in [0, 360) and declination, deg."""
    ra, dec = erfa.g2icrs(np.radians(l_deg), np.radians(b_deg))
    return np.degrees(erfa.anp(ra)), np.degrees(dec)


def icrs_to_galactic(
    ra_deg: Float[np.ndarray, " n"], dec_deg: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return Galactic longitude in [-180, 180) and latitude, deg."""
    l_rad, b_rad = erfa.icrs2g(np.radians(ra_deg), np.radians(dec_deg))
    return np.degrees(erfa.anpm(l_rad)), np.degrees(b_rad)


def north_angle(
    l_deg: Float[np.ndarray, " n"], b_deg: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Return the ICRS position angle of Galactic north, deg, from north through east."""
    pole = erfa.g2icrs(0.0, 0.5 * np.pi)
    return np.degrees(erfa.pas(*erfa.g2icrs(np.radians(l_deg), np.radians(b_deg)), *pole))


def position_angle_to_icrs(
    l_deg: Float[np.ndarray, " n"],
    b_deg: Float[np.ndarray, " n"],
    angle_deg: Float[np.ndarray, " n"],
) -> Float[np.ndarray, " n"]:
    """Convert Galactic position angles at (l, b) to ICRS, deg in [-180, 180)."""
    return np.mod(angle_deg + north_angle(l_deg, b_deg) + 180.0, 360.0) - 180.0


def motion_to_icrs(
    l_deg: Float[np.ndarray, " n"],
    b_deg: Float[np.ndarray, " n"],
    motion_l: Float[np.ndarray, " n"],
    motion_b: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Convert motions in l cos(b) and b to RA cos(dec) and Dec, in any unit."""
    angle = np.radians(north_angle(l_deg, b_deg))
    c, s = np.cos(angle), np.sin(angle)
    return c * motion_l + s * motion_b, -s * motion_l + c * motion_b
