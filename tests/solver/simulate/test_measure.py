"""Simulated measurements and their noise, compared with an independent computation."""

from dataclasses import replace

import erfa
import numpy as np
import pandas as pd
import pytest
from astropy.wcs import WCS
from numpy.polynomial.legendre import legval2d

from solver.data.instrument import MINI_MOCK, Detector
from solver.data.schema import ENVIRONMENT, MEASUREMENT
from solver.simulate.catalogue import truth_catalogue
from solver.simulate.measure import MeasuredOrbit, measure_orbit, true_places
from solver.simulate.placement import place_detectors
from solver.simulate.schedule import orbit_attitude
from solver.simulate.settings import SurveySettings

SETTINGS = SurveySettings(
    orbits=4,
    n_stars=2500,
    n_reference=500,
    n_artificial=100,
    detector_offset_um=30.0,
    detector_rotation_deg=0.03,
    pitch_relative=1e-4,
)
QUIET = replace(SETTINGS, measurement_mas=1e-9)
KEY = ["field_id", "plate_id"]
AU_PER_DAY_IN_C = erfa.DAU / erfa.DAYSEC / erfa.CMPS


@pytest.fixture(scope="module")
def truth() -> pd.DataFrame:
    return truth_catalogue(SETTINGS)


@pytest.fixture(scope="module")
def quiet(truth: pd.DataFrame) -> MeasuredOrbit:
    return measure_orbit(1, truth, QUIET)


@pytest.fixture(scope="module")
def noisy(truth: pd.DataFrame) -> MeasuredOrbit:
    return measure_orbit(1, truth, SETTINGS)


def independent_pixel(
    star: pd.Series,
    exposure: pd.Series,
    epoch: float,
    detector: Detector,
    satellite_km_s: np.ndarray | float = 0.0,
) -> np.ndarray:
    """The paper's observation model with ERFA, astropy's WCS and NumPy's Legendre polynomials."""
    mas = np.radians(1.0 / 3.6e6)
    centre = erfa.epv00(*erfa.tcbtdb(2400000.5, epoch))[1]["p"]
    a, d = np.radians([star["ra"], star["dec"]])
    east = np.array([-np.sin(a), np.cos(a), 0.0])
    north = np.array([-np.sin(d) * np.cos(a), -np.sin(d) * np.sin(a), np.cos(d)])
    years = (epoch - erfa.epj2jd(star["ref_epoch"])[1]) / 365.25
    place = erfa.s2c(a, d) + mas * (
        years * (star["pmra"] * east + star["pmdec"] * north) - star["parallax"] * centre
    )
    heliocentric, earth = erfa.epv00(*erfa.tcbtdb(2400000.5, exposure["obstime"]))
    velocity = earth["v"] * AU_PER_DAY_IN_C + np.asarray(satellite_km_s) * 1e3 / erfa.CMPS
    apparent = erfa.ab(
        place / np.linalg.norm(place),
        velocity,
        np.linalg.norm(heliocentric["p"]),
        np.sqrt(1.0 - velocity @ velocity),
    )
    ra, dec = np.degrees(erfa.c2s(apparent))

    wcs = WCS(naxis=2)
    wcs.wcs.ctype = "RA---TAN", "DEC--TAN"
    wcs.wcs.crval = exposure["ra"], exposure["dec"]
    wcs.wcs.crpix = 0.0, 0.0
    t = np.radians(exposure["position_angle"])
    # X = F (-xi cos + eta sin), Y = F (xi sin + eta cos): the inverse is itself over F^2.
    matrix = np.array([[-np.cos(t), np.sin(t)], [np.sin(t), np.cos(t)]])
    wcs.wcs.cd = np.degrees(matrix / exposure["true_focal_length"])
    ideal = np.array(wcs.wcs_world2pix([[ra, dec]], 0)[0]) + 1.0

    a_kl, b_kl = np.zeros((6, 6)), np.zeros((6, 6))
    a_kl[1, 1], a_kl[3, 0], a_kl[5, 0] = 0.2, 3.0, 0.3
    b_kl[1, 1], b_kl[0, 3], b_kl[0, 5] = 0.3, -3.0, 0.5
    focal = ideal + [legval2d(*(ideal / 21000.0), kl) for kl in (a_kl, b_kl)]

    t = np.radians(detector.rotation_deg)
    rotation = np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]])
    return (
        rotation
        @ (focal - [detector.x_um, detector.y_um])
        / [
            detector.pitch_x_um,
            detector.pitch_y_um,
        ]
    )


@pytest.mark.parametrize("detector_id", range(4))
def test_positions_agree_with_an_independent_computation(
    detector_id: int, truth: pd.DataFrame, quiet: MeasuredOrbit
) -> None:
    detector = place_detectors(MINI_MOCK, QUIET).detectors[detector_id]
    rows = quiet.measurements.query("detector_id == @detector_id").iloc[:8]
    stars, exposures = truth.set_index("source_id"), quiet.attitude.set_index(KEY)
    epoch = quiet.attitude["obstime"].mean()
    expected = [
        independent_pixel(
            stars.loc[row.source_id], exposures.loc[(row.field_id, row.plate_id)], epoch, detector
        )
        for row in rows.itertuples()
    ]
    np.testing.assert_allclose(rows[["nx", "ny"]], expected, rtol=0, atol=1e-6)


def test_true_places_are_without_aberration(truth: pd.DataFrame) -> None:
    stars = truth.iloc[:20]
    places = true_places(stars, 62502.0)
    observer = erfa.epv00(*erfa.tcbtdb(2400000.5, 62502.0))[1]["p"]
    years = (62502.0 - erfa.epj2jd(2016.0)[1]) / 365.25
    ra, dec = np.radians(stars["ra"]), np.radians(stars["dec"])
    mas = np.radians(1.0 / 3.6e6)
    direction = erfa.pmpx(
        ra,
        dec,
        mas * stars["pmra"] / np.cos(dec),
        mas * stars["pmdec"],
        stars["parallax"] / 1e3,
        0.0,
        years,
        observer,
    )
    ra, dec = erfa.c2s(direction)
    # ERFA adds the light travel time across the Earth's orbit, 0.016 uas per mas/yr.
    np.testing.assert_allclose(places["ra"], np.degrees(erfa.anp(ra)), rtol=0, atol=2e-9)
    np.testing.assert_allclose(places["dec"], np.degrees(dec), rtol=0, atol=2e-9)
    np.testing.assert_array_equal(places["source_id"], stars["source_id"])


def test_noise_has_the_stated_width(quiet: MeasuredOrbit, noisy: MeasuredOrbit) -> None:
    key = [*KEY, "detector_id", "source_id"]
    pd.testing.assert_frame_equal(quiet.measurements[key], noisy.measurements[key])
    expected = np.radians(4e-3 / 3600.0) * 4.86e6 / 10.0
    for axis in "xy":
        noise = noisy.measurements[f"n{axis}"] - quiet.measurements[f"n{axis}"]
        assert noise.std() == pytest.approx(expected, rel=0.03)
        assert abs(noise.mean()) < 5 * expected / np.sqrt(len(noise))
        np.testing.assert_allclose(noisy.measurements[f"s{axis}"], expected, rtol=1e-12)


def test_tables_are_canonical_and_in_random_order(noisy: MeasuredOrbit) -> None:
    assert list(noisy.measurements.columns) == MEASUREMENT.names
    assert list(noisy.exposures.columns) == ENVIRONMENT.names
    assert noisy.measurements["source_id"].dtype == np.int64
    assert not noisy.measurements.duplicated(list(MEASUREMENT.key)).any()
    plate = noisy.measurements["field_id"] * 24 + noisy.measurements["plate_id"]
    assert abs(np.corrcoef(plate, np.arange(len(plate)))[0, 1]) < 0.05


@pytest.mark.parametrize(
    ("row", "column", "sign"),
    [((2, 0, 5.0, 0.0), "nx", 1.0), ((0, 2, 0.0, -5.0), "ny", -1.0)],
    ids=["A20", "B02"],
)
def test_distortion_has_the_right_sign(
    row: tuple, column: str, sign: float, truth: pd.DataFrame
) -> None:
    without, with_term = (
        measure_orbit(0, truth, replace(QUIET, distortion_um=rows)).measurements.set_index(
            list(MEASUREMENT.key)
        )
        for rows in ((), (row,))
    )
    # Detector 0 is not rotated; L_2(x) - L_2(0) = 1.5 x^2 is positive everywhere.
    moved = (with_term[column] - without[column]).dropna().xs(0, level="detector_id")
    assert (sign * moved > 0.0).mean() > 0.99
    assert 0.5 < (sign * moved).max() < 5.0 * 1.5 / 10.0


def test_a_star_in_the_gap_is_not_measured() -> None:
    still = SurveySettings(
        orbits=1, pointing_start_arcsec=0.0, pointing_walk_arcsec=0.0, measurement_mas=1e-9
    )
    pointing = orbit_attitude(0, still, 4.86e6).iloc[0]
    truth = truth_catalogue(SurveySettings(n_stars=2, n_reference=1, n_artificial=0)).assign(
        ra=pointing["ra"],
        dec=[pointing["dec"] + 0.005, pointing["dec"] + 0.1],
        pmra=0.0,
        pmdec=0.0,
        parallax=0.0,
    )
    measured = measure_orbit(0, truth, still).measurements
    first_field = measured[measured["field_id"] == 0]
    assert first_field["source_id"].unique().tolist() == [truth["source_id"][1]]
    assert len(first_field) == 24


def test_no_measurement_lies_off_its_detector(quiet: MeasuredOrbit) -> None:
    largest = quiet.measurements[["nx", "ny"]].abs().max()
    assert (largest < 960.0).all()
    assert (largest > 940.0).all()


def test_detectors_of_other_sizes_and_ids_are_respected(truth: pd.DataFrame) -> None:
    detectors = (
        replace(MINI_MOCK.detectors[2], detector_id=7, n_x=400),
        replace(MINI_MOCK.detectors[0], detector_id=3),
    )
    measured = measure_orbit(0, truth, QUIET, replace(MINI_MOCK, detectors=detectors)).measurements
    assert sorted(measured["detector_id"].unique()) == [3, 7]
    narrow = measured[measured["detector_id"] == 7]
    assert 150.0 < narrow["nx"].abs().max() < 200.0
    assert narrow["ny"].abs().max() > 900.0


def test_orbit_depends_only_on_its_id_and_the_seed(
    truth: pd.DataFrame, noisy: MeasuredOrbit
) -> None:
    measure_orbit(0, truth, SETTINGS)
    again = measure_orbit(1, truth, SETTINGS)
    pd.testing.assert_frame_equal(again.measurements, noisy.measurements)
    other = measure_orbit(1, truth, replace(SETTINGS, seed=5))
    assert not np.isin(other.measurements["nx"], noisy.measurements["nx"]).any()


def test_sources_outside_the_field_give_no_measurements(truth: pd.DataFrame) -> None:
    assert measure_orbit(0, truth.assign(dec=60.0), QUIET).measurements.empty
