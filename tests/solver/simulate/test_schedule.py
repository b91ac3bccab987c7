"""Schedule of the exposures, and random walks of pointing and focal length."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from astropy.time import Time

from solver.data.instrument import MINI_MOCK
from solver.data.schema import ENVIRONMENT
from solver.simulate.placement import place_detectors
from solver.simulate.schedule import environment, orbit_attitude, orbit_schedule, schedule
from solver.simulate.settings import SurveySettings
from solver.simulate.sky import icrs_to_galactic, position_angle_to_icrs

SETTINGS = SurveySettings(orbits=200)
NOMINAL_UM = 4.86e6


@pytest.fixture(scope="module")
def attitudes() -> pd.DataFrame:
    return pd.concat([orbit_attitude(o, SETTINGS, NOMINAL_UM) for o in range(SETTINGS.orbits)])


@pytest.fixture(scope="module")
def pointing_offsets(attitudes: pd.DataFrame) -> np.ndarray:
    """Offsets from the schedule in l cos(b), b and position angle, arcsec.

    The axes are orbit, field, plate and coordinate.
    """
    l_deg, b_deg = icrs_to_galactic(attitudes["ra"].to_numpy(), attitudes["dec"].to_numpy())
    scheduled = position_angle_to_icrs(l_deg, b_deg, attitudes["pa"].to_numpy())
    pa = attitudes["position_angle"] - scheduled
    offsets = np.stack(
        [
            (l_deg - attitudes["glon"]) * np.cos(np.radians(b_deg)),
            b_deg - attitudes["glat"],
            (pa + 180.0) % 360.0 - 180.0,
        ],
        axis=-1,
    )
    return 3600.0 * offsets.reshape(SETTINGS.orbits, 4, 24, 3)


def test_schedule_has_every_exposure_once() -> None:
    settings = SurveySettings(orbits=3)
    table = schedule(settings)
    assert len(table) == 3 * 96
    assert not table.duplicated(["orbit_id", "field_id", "plate_id"]).any()
    assert table["orbit_id"].unique().tolist() == [0, 1, 2]
    assert table["field_id"].unique().tolist() == [0, 1, 2, 3]
    assert table["plate_id"].unique().tolist() == list(range(24))
    assert table["obstime"].is_monotonic_increasing


def test_times_are_middles_of_exposures() -> None:
    seconds = orbit_schedule(0, SETTINGS)["obstime"].to_numpy() * 86400.0
    steps = np.diff(seconds)
    start = Time("2028-02-01", scale="tcb").mjd * 86400.0
    assert seconds[0] - start == pytest.approx(10.0, abs=1e-4)
    np.testing.assert_allclose(steps[[23, 47, 71]], 20.0 + 90.0, atol=1e-4)
    np.testing.assert_allclose(np.delete(steps, [23, 47, 71]), 20.0, atol=1e-4)


def test_orbits_split_the_seasons_evenly() -> None:
    starts = np.array([orbit_schedule(o, SETTINGS)["obstime"].iloc[0] for o in range(200)])
    edges = Time(
        [f"{year}-{month}-01" for year in (2028, 2029, 2030) for month in ("02", "05", "08", "11")],
        scale="tcb",
    ).mjd.reshape(6, 2)
    inside = (starts[:, None] >= edges[:, 0]) & (starts[:, None] < edges[:, 1])
    assert inside.any(axis=1).all()
    gap = np.diff(starts)
    np.testing.assert_allclose(gap[gap < 50.0], 544.0 / 200, atol=1e-9)
    assert (gap > 50.0).sum() == 5


def test_position_angle_alternates_with_the_seasons() -> None:
    table = schedule(SETTINGS).drop_duplicates("orbit_id")
    is_autumn = Time(table["obstime"].to_numpy(), format="mjd", scale="tcb").strftime("%m") > "07"
    np.testing.assert_array_equal(table["pa"], np.where(is_autumn, 180.0, 0.0))
    assert 0.4 < is_autumn.mean() < 0.6


def test_pairs_of_fields_overlap_by_half() -> None:
    fields = orbit_schedule(5, SETTINGS).drop_duplicates("field_id")
    l_deg = fields["glon"].to_numpy() * np.cos(np.radians(fields["glat"].to_numpy()))
    b_deg = fields["glat"].to_numpy()
    np.testing.assert_allclose([b_deg[1] - b_deg[0], l_deg[3] - l_deg[2]], 0.24, atol=1e-5)
    np.testing.assert_allclose([l_deg[1] - l_deg[0], b_deg[3] - b_deg[2]], 0.0, atol=1e-5)


def test_middle_and_corner_of_the_artificial_square_are_observed_often_enough() -> None:
    fields = schedule(SETTINGS).drop_duplicates(["orbit_id", "field_id"])
    seen = []
    for l_deg, b_deg in ((-0.3, 0.1), (0.0, 0.4)):
        inside = (np.abs(fields["glon"] - l_deg) < 0.24) & (np.abs(fields["glat"] - b_deg) < 0.24)
        seen.append(fields.loc[inside, "orbit_id"].nunique() / SETTINGS.orbits)
    assert seen[0] > 0.85
    assert seen[1] > 0.3


def test_pointing_starts_and_walks_with_the_stated_scatter(pointing_offsets: np.ndarray) -> None:
    starts, steps = pointing_offsets[:, :, 0], np.diff(pointing_offsets, axis=2)
    np.testing.assert_allclose(starts.std(axis=(0, 1)), 1.0, atol=0.12)
    np.testing.assert_allclose(steps.std(axis=(0, 1, 2)), 1.0, atol=0.03)
    # The walk restarts at each field: the last exposure is 24 steps from the schedule.
    np.testing.assert_allclose(
        pointing_offsets[:, :, -1].std(axis=(0, 1)), np.sqrt(24.0), rtol=0.12
    )


def test_focal_length_walks_through_the_whole_orbit(attitudes: pd.DataFrame) -> None:
    scale = attitudes["true_focal_length"].to_numpy().reshape(-1, 96) / NOMINAL_UM
    steps = scale[:, 1:] / scale[:, :-1] - 1.0
    assert (scale[:, 0] - 1.0).std() == pytest.approx(1e-3, rel=0.2)
    assert steps.std() == pytest.approx(1e-4, rel=0.03)
    assert steps[:, [23, 47, 71]].std() == pytest.approx(1e-4, rel=0.15)
    assert (attitudes["focal_length"] == NOMINAL_UM).all()


def test_estimates_have_errors_of_one_arcsecond(attitudes: pd.DataFrame) -> None:
    cosine = np.cos(np.radians(attitudes["dec"]))
    for error in (
        (attitudes["ra_est"] - attitudes["ra"]) * cosine,
        attitudes["dec_est"] - attitudes["dec"],
        attitudes["pa_est"] - attitudes["position_angle"],
    ):
        assert 3600.0 * error.std() == pytest.approx(1.0, rel=0.03)


def test_environment_has_no_true_values(attitudes: pd.DataFrame) -> None:
    assert list(environment(attitudes).columns) == ENVIRONMENT.names


def test_number_of_orbits_changes_only_the_times() -> None:
    few, many = (orbit_attitude(2, replace(SETTINGS, orbits=n), NOMINAL_UM) for n in (6, 12))
    same = ["orbit_id", "field_id", "plate_id", "glon", "glat", "true_focal_length"]
    pd.testing.assert_frame_equal(few[same], many[same])
    assert (few["obstime"] != many["obstime"]).all()


def test_orbits_differ() -> None:
    first, second = (orbit_attitude(o, SETTINGS, NOMINAL_UM) for o in (0, 1))
    assert not np.isin(first["true_focal_length"], second["true_focal_length"]).any()


def test_a_single_pair_and_short_fields_are_scheduled() -> None:
    settings = SurveySettings(orbits=1, pair_axes=("l",), exposures_per_field=2)
    table = orbit_schedule(0, settings)
    assert table["field_id"].tolist() == [0, 0, 1, 1]


def test_detectors_stay_nominal_by_default() -> None:
    assert place_detectors(MINI_MOCK, SETTINGS) == MINI_MOCK


def test_detectors_are_displaced_once_by_the_stated_scatter() -> None:
    settings = replace(
        SETTINGS, detector_offset_um=30.0, detector_rotation_deg=0.03, pitch_relative=1e-4
    )
    placed = place_detectors(MINI_MOCK, settings)
    assert placed == place_detectors(MINI_MOCK, replace(settings, orbits=3))
    for true, nominal in zip(placed.detectors, MINI_MOCK.detectors, strict=True):
        assert 0.0 < abs(true.x_um - nominal.x_um) < 120.0
        assert 0.0 < abs(true.y_um - nominal.y_um) < 120.0
        assert 0.0 < abs(true.rotation_deg - nominal.rotation_deg) < 0.12
        assert 0.0 < abs(true.pitch_x_um / nominal.pitch_x_um - 1.0) < 4e-4
        assert 0.0 < abs(true.pitch_y_um / nominal.pitch_y_um - 1.0) < 4e-4
