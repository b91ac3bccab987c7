"""Galactic coordinates compared with astropy, which defines them through FK5."""

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord

from solver.simulate.sky import (
    galactic_to_icrs,
    icrs_to_galactic,
    motion_to_icrs,
    position_angle_to_icrs,
)

L_DEG = np.array([-1.9, -0.3, 0.0, 1.2, 95.0, -170.0])
B_DEG = np.array([-1.1, 0.1, 0.0, 1.1, 40.0, -75.0])
# The two definitions of the frame differ by some 20 mas.
TOLERANCE = 50 * u.mas


def test_positions_agree_with_astropy() -> None:
    ours = SkyCoord(*galactic_to_icrs(L_DEG, B_DEG), unit="deg")
    theirs = SkyCoord(L_DEG, B_DEG, unit="deg", frame="galactic").icrs
    assert np.all(ours.separation(theirs) < TOLERANCE)


def test_positions_round_trip() -> None:
    l_deg, b_deg = icrs_to_galactic(*galactic_to_icrs(L_DEG, B_DEG))
    np.testing.assert_allclose(l_deg, L_DEG, atol=1e-11)
    np.testing.assert_allclose(b_deg, B_DEG, atol=1e-11)


@pytest.mark.parametrize("angle", [0.0, 37.0, 180.0])
def test_position_angles_agree_with_astropy(angle: float) -> None:
    start = SkyCoord(L_DEG, B_DEG, unit="deg", frame="galactic")
    end = start.directional_offset_by(angle * u.deg, 1 * u.arcmin)
    expected = start.icrs.position_angle(end.icrs).deg
    ours = position_angle_to_icrs(L_DEG, B_DEG, np.full_like(L_DEG, angle))
    assert np.all((ours >= -180.0) & (ours < 180.0))
    np.testing.assert_allclose((ours - expected + 180.0) % 360.0 - 180.0, 0.0, atol=1e-4)


def test_motions_agree_with_astropy() -> None:
    star = SkyCoord(
        l=L_DEG * u.deg,
        b=B_DEG * u.deg,
        pm_l_cosb=3.0 * np.ones(6) * u.mas / u.yr,
        pm_b=-4.0 * np.ones(6) * u.mas / u.yr,
        frame="galactic",
    ).icrs
    pmra, pmdec = motion_to_icrs(L_DEG, B_DEG, np.full(6, 3.0), np.full(6, -4.0))
    np.testing.assert_allclose(pmra, star.pm_ra_cosdec.to_value("mas/yr"), atol=1e-5)
    np.testing.assert_allclose(pmdec, star.pm_dec.to_value("mas/yr"), atol=1e-5)
