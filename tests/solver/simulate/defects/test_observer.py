"""The satellite's velocity, against an independent observation model, and recorded times."""

import erfa
import numpy as np
import pandas as pd
import pytest

from solver.data.instrument import MINI_MOCK
from solver.simulate.defects.defect import AppliedDefect
from solver.simulate.defects.observer import satellite_velocity
from solver.simulate.placement import place_detectors
from tests.solver.simulate.defects.conftest import ORBIT, QUIET
from tests.solver.simulate.test_measure import independent_pixel

VELOCITY = ["satellite_vx", "satellite_vy", "satellite_vz"]


@pytest.fixture
def velocity(measure):
    case = AppliedDefect("satellite-velocity", 7.6, QUIET, ORBIT)
    return satellite_velocity(case, measure().attitude)[VELOCITY].to_numpy()


def test_satellite_circles_the_earth_at_right_angles_to_the_sun(velocity, measure):
    np.testing.assert_allclose(np.linalg.norm(velocity, axis=1), 7.6, rtol=1e-12)
    time = measure().attitude["obstime"].to_numpy()
    earth = erfa.epv00(*erfa.tcbtdb(2400000.5, time.mean()))[0]["p"]
    np.testing.assert_allclose(velocity @ earth / np.linalg.norm(earth), 0.0, atol=1e-9)
    turned = np.arccos(velocity[0] @ velocity[-1] / 7.6**2)
    assert turned == pytest.approx(2.0 * np.pi * 86_400.0 * (time[-1] - time[0]) / 5_801.0)


def test_satellite_velocity_aberrates_and_is_not_in_the_table(velocity, measure, truth):
    orbit = measure("satellite-velocity=7.6km/s", settings=QUIET)
    assert (orbit.exposures[VELOCITY] == 0.0).all(axis=None)
    attitude = orbit.attitude.set_index(["field_id", "plate_id"])
    stars, detectors = truth.set_index("source_id"), place_detectors(MINI_MOCK, QUIET).detectors
    rows = orbit.measurements.iloc[:24]
    expected = [
        independent_pixel(
            stars.loc[row.source_id],
            attitude.loc[(row.field_id, row.plate_id)],
            orbit.attitude["obstime"].mean(),
            detectors[row.detector_id],
            velocity[row.field_id * 24 + row.plate_id],
        )
        for row in rows.itertuples()
    ]
    np.testing.assert_allclose(rows[["nx", "ny"]], expected, rtol=0, atol=1e-6)


def test_satellite_velocity_shifts_stars_by_seconds_of_arc(compare):
    rows = compare("satellite-velocity=7.6km/s")
    arcsec = np.hypot(rows["dx"], rows["dy"]) * np.degrees(10.0 / 4.86e6) * 3600.0
    assert 0.1 < arcsec.max() < np.degrees(7.6 / 299_792.458) * 3600.0 * 1.01


def test_recorded_times_are_late_by_the_amplitude_and_nothing_else_changes(measure):
    without, orbit = measure(), measure("exposure-times=1h")
    late = orbit.exposures["obstime"] - without.exposures["obstime"]
    np.testing.assert_allclose(late, 1.0 / 24.0, rtol=1e-6)
    for table, before in (
        (orbit.exposures.drop(columns="obstime"), without.exposures.drop(columns="obstime")),
        (orbit.measurements, without.measurements),
    ):
        pd.testing.assert_frame_equal(table, before)
