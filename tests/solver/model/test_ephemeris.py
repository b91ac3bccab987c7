import numpy as np
from astropy import constants
from astropy import units as u
from astropy.coordinates import get_body_barycentric, get_body_barycentric_posvel
from astropy.time import Time

from solver.model.apparent_motion import motion_design, parallax_factors
from solver.model.ephemeris import observer_at

MJD = np.array([61_800.0, 61_822.3, 62_100.7])


def test_state_agrees_with_astropy():
    when = Time(MJD, format="mjd", scale="tcb")
    position, velocity = get_body_barycentric_posvel("earth", when, ephemeris="builtin")
    ours = observer_at(MJD)
    np.testing.assert_allclose(ours.position, position.xyz.to_value(u.au).T, atol=1e-13)
    expected = (velocity.xyz / constants.c).to_value(u.dimensionless_unscaled).T
    np.testing.assert_allclose(ours.velocity, expected, atol=1e-15)


def test_sun_distance_agrees_with_astropy():
    when = Time(MJD, format="mjd", scale="tcb")
    earth, sun = (get_body_barycentric(b, when, ephemeris="builtin") for b in ("earth", "sun"))
    expected = (earth - sun).norm().to_value(u.au)
    np.testing.assert_allclose(observer_at(MJD).sun_distance, expected, atol=1e-12)


def test_satellite_only_adds_its_velocity():
    satellite = np.array([[7.6, 0.0, 0.0], [0.0, -7.6, 0.0], [0.0, 0.0, 3.0]])
    still, moving = observer_at(MJD), observer_at(MJD, satellite)
    difference = (moving.velocity - still.velocity) * constants.c.to_value(u.km / u.s)
    np.testing.assert_allclose(difference, satellite, atol=1e-9)
    np.testing.assert_array_equal(moving.position, still.position)


def test_time_scale_is_barycentric_coordinate_time():
    """TCB is ahead of TDB by some 25 s in 2028, in which the Earth moves 740 km."""
    as_tdb = Time(MJD, format="mjd", scale="tdb").tcb.mjd
    moved = observer_at(as_tdb).position - observer_at(MJD).position
    kilometres = np.linalg.norm(moved, axis=1) * u.au.to(u.km)
    np.testing.assert_allclose(kilometres, 25.0 * 29.8, rtol=0.05)


def test_parallax_of_a_motion_is_that_of_its_times_and_place():
    """The positions of the Earth are kept, and another source and other times have their own."""
    for ra, dec, mjd in ((266.4, -28.9, MJD), (10.0, 40.0, MJD), (10.0, 40.0, MJD + 91.0)):
        expected = parallax_factors(ra, dec, observer_at(mjd).position)
        for _ in range(2):
            design = motion_design(ra, dec, mjd, 2028.0)
            np.testing.assert_array_equal(design[:, :, 2].T, expected)
            design[:] = 0.0
