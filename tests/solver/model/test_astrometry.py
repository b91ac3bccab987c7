import erfa
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.model.astrometry import frames_at, propagate, sky_position
from solver.model.directions import tangent_frame
from tests.solver.small_orbit import ASTROMETRY, MAS, MJD, earth, epoch_places, make_orbit

HUNDREDTH_UAS = 1e-5 * MAS


def one_source(**changes):
    row = {"ra": 266.1, "dec": -29.1, "parallax": 0.0, "pmra": 0.0, "pmdec": 0.0}
    row |= {f"{name}_error": 0.0 for name in ASTROMETRY}
    row |= {f"{a}_{b}_corr": 0.0 for i, a in enumerate(ASTROMETRY) for b in ASTROMETRY[i + 1 :]}
    return pd.DataFrame([row | {"ref_epoch": 2016.0} | changes])


@settings(deadline=None, max_examples=60)
@given(
    st.floats(0.0, 359.99),
    st.floats(-85.0, 85.0),
    st.floats(-200.0, 200.0),
    st.floats(-200.0, 200.0),
    st.floats(0.0, 100.0),
    st.floats(60_000.0, 63_000.0),
)
def test_direction_agrees_with_erfa_space_motion(ra, dec, pmra, pmdec, parallax, mjd):
    source = one_source(ra=ra, dec=dec, pmra=pmra, pmdec=pmdec, parallax=parallax)
    expected = erfa.s2c(*np.radians(epoch_places(source, mjd)))[0]
    ours = propagate(source, mjd, earth(mjd)[0]).frame[0, 0]
    assert np.linalg.norm(ours - expected) < HUNDREDTH_UAS


def test_epoch_is_a_julian_year():
    """J2016.0 is MJD 57388.5; an error of half a day would be 1.4 uas per mas/yr."""
    source = one_source(pmra=1000.0)
    start = tangent_frame(source["ra"].to_numpy(), source["dec"].to_numpy())[0]
    still = propagate(source, 57_388.5, np.zeros(3)).frame[0, 0]
    np.testing.assert_allclose(still, start[0], atol=1e-15)
    moved = propagate(source, 57_388.5 + 365.25, np.zeros(3)).frame[0, 0]
    assert moved @ start[1] == pytest.approx(1000.0 * MAS, rel=1e-9)


def test_parallax_moves_the_source_away_from_the_observer():
    source = one_source(ra=0.0, dec=0.0, parallax=10.0)
    moved = propagate(source, MJD, np.array([0.0, 1.0, 0.0])).frame[0, 0]
    assert moved[1] == pytest.approx(-10.0 * MAS, rel=1e-9)


def test_covariance_agrees_with_sampled_catalogues():
    source = one_source(
        parallax=5.0,
        ra_error=0.3,
        dec_error=0.2,
        parallax_error=0.4,
        pmra_error=0.05,
        pmdec_error=0.08,
        ra_pmra_corr=0.6,
        dec_parallax_corr=-0.4,
        pmra_pmdec_corr=0.3,
    )
    position = earth(MJD)[0]
    n, rng = 20_000, np.random.default_rng(2)
    correlation = np.eye(5)
    correlation[0, 3] = correlation[3, 0] = 0.6
    correlation[1, 2] = correlation[2, 1] = -0.4
    correlation[3, 4] = correlation[4, 3] = 0.3
    sigma = np.array([source[f"{name}_error"].iloc[0] for name in ASTROMETRY])
    draws = rng.multivariate_normal(np.zeros(5), correlation * np.outer(sigma, sigma), n)
    sample = pd.concat([source] * n, ignore_index=True)
    sample["ra"] += draws[:, 0] / 3.6e6 / np.cos(np.radians(sample["dec"]))
    sample["dec"] += draws[:, 1] / 3.6e6
    for i, name in enumerate(ASTROMETRY[2:], start=2):
        sample[name] += draws[:, i]
    places = propagate(source, MJD, position)
    moved = propagate(sample, MJD, position).frame[:, 0] @ places.frame[0, 1:].T / MAS
    scale = np.sqrt(np.diag(places.covariance[0]))
    expected = places.covariance[0] / np.outer(scale, scale)
    found = np.cov(moved.T) / np.outer(scale, scale)
    np.testing.assert_allclose(found, expected, atol=5.0 / np.sqrt(n))


def test_covariance_at_the_reference_epoch_is_that_of_the_catalogue():
    source = one_source(ra_error=0.3, dec_error=0.2, pmra_error=9.0, ra_dec_corr=0.5)
    covariance = propagate(source, 57_388.5, np.zeros(3)).covariance[0]
    np.testing.assert_allclose(covariance, [[0.09, 0.03], [0.03, 0.04]], atol=1e-12)


@settings(deadline=None, max_examples=40)
@given(st.floats(0.0, 359.999999), st.floats(-89.9, 89.9), st.floats(0.1, 10.0))
def test_sky_position_inverts_tangent_frame(ra, dec, length):
    direction = length * tangent_frame(np.array([ra]), np.array([dec]))[:, 0]
    found_ra, found_dec = sky_position(direction)
    turn = (found_ra[0] - ra + 180.0) % 360.0 - 180.0
    assert abs(turn) * np.cos(np.radians(dec)) < 1e-12
    assert found_dec[0] == pytest.approx(dec, abs=1e-12)


@pytest.mark.parametrize("ra", [-1e-9, -1e-17, 0.0, 360.0], ids=str)
def test_right_ascension_is_below_360_degrees(ra):
    found, _ = sky_position(tangent_frame(np.array([ra]), np.array([12.0]))[:, 0])
    assert 0.0 <= found[0] < 360.0


def test_sources_of_an_orbit_keep_their_order():
    catalogue = make_orbit().data.catalogue
    ra, dec = sky_position(propagate(catalogue, MJD, earth(MJD)[0]).frame[:, 0])
    expected = epoch_places(catalogue, MJD)
    np.testing.assert_allclose(ra, expected[0], atol=3e-13)
    np.testing.assert_allclose(dec, expected[1], atol=3e-13)


def test_catalogue_without_uncertainties_has_frames(small_orbit):
    errors = [c for c in small_orbit.data.truth if c.endswith("_error")]
    truth = small_orbit.data.truth.drop(columns=errors)
    ra, _ = sky_position(frames_at(truth, MJD, earth(MJD)[0])[:, 0])
    np.testing.assert_allclose(ra, epoch_places(truth, MJD)[0], atol=3e-13)
