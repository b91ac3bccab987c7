import jax.numpy as jnp
import numpy as np
from astropy.wcs import WCS
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.model.directions import displaced, tangent_frame, unproject
from solver.model.projection import displace, focal_axes, project
from tests.solver.small_orbit import ideal_plane, standard_coordinates

FOCAL_LENGTH = 4.86e6
longitudes = st.floats(0.0, 359.999)
latitudes = st.floats(-80.0, 80.0)
separations = st.floats(-0.6, 0.6)


def project_one(source, pointing, angle_deg):
    frame = tangent_frame(np.array([pointing[0]]), np.array([pointing[1]]))
    axes = focal_axes(jnp.asarray(frame[:, 0]), jnp.array([np.radians(angle_deg)]))
    direction = tangent_frame(np.array([source[0]]), np.array([source[1]]))[:, 0]
    components = jnp.einsum("oij,oj->oi", axes, jnp.asarray(direction))
    return np.concatenate(project(tuple(components.T), jnp.array([FOCAL_LENGTH])))


def astropy_plane(source, pointing, angle_deg):
    """Return the ideal focal plane of a FITS header whose CD matrix is Eq. (method:ideal)."""
    wcs = WCS(naxis=2)
    wcs.wcs.ctype = ["RA---TAN", "DEC--TAN"]
    wcs.wcs.crval = pointing
    wcs.wcs.crpix = [1.0, 1.0]
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    # (xi, eta) = CD (X, Y): the inverse of the paper's rotation of (-xi, eta).
    wcs.wcs.cd = np.degrees(1.0 / FOCAL_LENGTH) * np.array([[-c, s], [s, c]])
    return wcs.wcs_world2pix([source], 0)[0]


@settings(deadline=None, max_examples=40)
@given(longitudes, latitudes, separations, separations, st.floats(-180.0, 180.0))
def test_ideal_plane_agrees_with_astropy_wcs(ra, dec, east, north, angle):
    source = ((ra + east / np.cos(np.radians(dec))) % 360.0, dec + north)
    ours = project_one(source, (ra, dec), angle)
    # 1e-6 um is 0.04 uas; WCSLIB works in degrees.
    np.testing.assert_allclose(ours, astropy_plane(source, (ra, dec), angle), atol=1e-6)


@settings(deadline=None, max_examples=40)
@given(longitudes, latitudes, separations, separations, st.floats(-180.0, 180.0))
def test_ideal_plane_agrees_with_the_papers_trigonometry(ra, dec, east, north, angle):
    source = (ra + east / np.cos(np.radians(dec)), dec + north)
    coordinates = standard_coordinates(*np.radians([*source, ra, dec]))
    expected = ideal_plane(*coordinates, np.radians(angle), FOCAL_LENGTH)
    np.testing.assert_allclose(project_one(source, (ra, dec), angle), expected, atol=1e-7)


@settings(deadline=None, max_examples=40)
@given(longitudes, latitudes, separations, separations, st.floats(-180.0, 180.0))
def test_unproject_undoes_the_projection(ra, dec, x_deg, y_deg, angle):
    frame = tangent_frame(np.array([ra]), np.array([dec]))[0]
    ideal = FOCAL_LENGTH * np.radians([[x_deg, y_deg]])
    (direction,) = unproject(ideal, frame, np.radians(angle), FOCAL_LENGTH)
    axes = focal_axes(jnp.asarray(frame[:1]), jnp.array([np.radians(angle)]))
    components = (axes @ direction).T
    found = project(tuple(components), jnp.array([FOCAL_LENGTH]))
    np.testing.assert_allclose(np.concatenate(found), ideal[0], atol=1e-8)


@settings(deadline=None, max_examples=20)
@given(longitudes, latitudes)
def test_tangent_frame_is_orthonormal_and_right_handed(ra, dec):
    frame = tangent_frame(np.array([ra]), np.array([dec]))[0]
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(np.cross(frame[0], frame[1]), frame[2], atol=1e-15)


@settings(deadline=None, max_examples=20)
@given(longitudes, latitudes)
def test_east_and_north_point_to_increasing_coordinates(ra, dec):
    step = 1e-4
    at = np.array([ra, ra + step / np.cos(np.radians(dec)), ra])
    directions = tangent_frame(at, np.array([dec, dec, dec + step]))
    moved = (directions[1:, 0] - directions[0, 0]) / np.radians(step)
    np.testing.assert_allclose(moved, directions[0, 1:], atol=1e-5)


@settings(deadline=None, max_examples=20)
@given(longitudes, latitudes, st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3))
def test_displacement_is_in_the_tangent_plane(ra, dec, east, north):
    frame = tangent_frame(np.array([ra]), np.array([dec]))
    moved = np.asarray(displace(jnp.asarray(frame), jnp.array([east]), jnp.array([north])))[0]
    along, e, n = frame[0] @ moved
    np.testing.assert_allclose([e / along, n / along], [east, north], atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(moved), 1.0, atol=1e-15)


def test_displacement_resolves_a_hundredth_of_a_microarcsecond():
    frame = tangent_frame(np.array([266.4]), np.array([-28.9]))
    step = np.radians(0.01e-6 / 3600.0)
    moved = displace(jnp.asarray(frame), jnp.array([step]), jnp.array([0.0]))
    np.testing.assert_allclose(np.asarray(moved)[0] @ frame[0, 1], step, rtol=1e-2)


def test_optical_axis_falls_on_the_origin():
    np.testing.assert_allclose(project_one((10.0, 20.0), (10.0, 20.0), 33.0), 0.0, atol=1e-8)


def test_x_points_west_and_y_north_at_position_angle_zero():
    x, y = project_one((10.1, 20.1), (10.0, 20.0), 0.0)
    assert x < 0 < y


def test_displacement_in_numpy_equals_that_in_jax():
    rng = np.random.default_rng(0)
    frame = tangent_frame(rng.uniform(0.0, 360.0, 5), rng.uniform(-80.0, 80.0, 5))
    east, north = rng.normal(0.0, 1e-3, (2, 5))
    expected = displace(jnp.asarray(frame), jnp.asarray(east), jnp.asarray(north))
    np.testing.assert_allclose(displaced(frame, east, north), expected, rtol=0.0, atol=1e-15)
