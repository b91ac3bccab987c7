"""Defects of the table of measurements: which rows are wrong, by how much, and the rest."""

import numpy as np
import pandas as pd
import pytest

from solver.data.defect_schema import AFFECTED
from tests.solver.simulate.defects.conftest import KEY

EXPOSURE = ["field_id", "plate_id", "detector_id"]


def test_outliers_are_the_listed_rows_and_5_to_50_sigma_away(measure):
    without, orbit = measure().measurements, measure("outliers=3%")
    assert list(orbit.affected.columns) == AFFECTED.names
    assert len(orbit.affected) == round(0.03 * len(without))
    assert set(orbit.affected["defect"]) == {"outliers"}
    pd.testing.assert_frame_equal(orbit.measurements[KEY], without[KEY])
    listed = without[KEY].merge(orbit.affected, how="left", on=KEY)
    for axis in "xy":
        found = orbit.measurements[f"n{axis}"] - without[f"n{axis}"]
        expected = listed[f"shift_{axis}"].fillna(0.0)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    sigmas = np.hypot(listed["shift_x"], listed["shift_y"]).dropna() / without["sx"].iloc[0]
    assert sigmas.between(5.0, 50.0).all()
    # The mean of a log-uniform variable.
    assert np.log(sigmas).mean() == pytest.approx(0.5 * np.log(250.0), abs=0.2)
    assert orbit.affected["true_source_id"].equals(orbit.affected["source_id"])


def test_swapped_rows_have_the_ids_of_neighbours(measure):
    without, orbit = measure().measurements, measure("swapped=4%")
    found = orbit.measurements
    others = [name for name in found if name != "source_id"]
    pd.testing.assert_frame_equal(found[others], without[others])
    wrong = found["source_id"] != without["source_id"]
    assert wrong.sum() == 2 * round(0.02 * len(without))
    assert not found.duplicated(KEY).any()
    listed = found.merge(orbit.affected, how="left", on=KEY)["true_source_id"]
    np.testing.assert_array_equal(listed.notna(), wrong)
    np.testing.assert_array_equal(listed[wrong], without["source_id"][wrong])
    # Each of a pair has the id of the other one, which is on the same detector and exposure.
    for _, group in without.assign(given=found["source_id"])[wrong].groupby(EXPOSURE):
        assert set(group["given"]) == set(group["source_id"])
        given_of = dict(zip(group["source_id"], group["given"], strict=True))
        assert all(given_of[given_of[one]] == one for one in given_of)


def test_swapped_rows_are_the_nearest_that_were_free(measure):
    without, orbit = measure().measurements, measure("swapped=0.5%")
    place = without.set_index(KEY)[["nx", "ny"]].sort_index()
    nearest = 0
    for row in orbit.affected.itertuples():
        here = (row.orbit_id, row.field_id, row.plate_id, row.detector_id)
        beside = place.loc[here]
        apart = np.hypot(*(beside - beside.loc[row.true_source_id]).to_numpy().T)
        nearest += beside.index[np.argsort(apart)[1]] == row.source_id
    # One of a pair was chosen, and has its nearest neighbour.
    assert nearest >= len(orbit.affected) / 2


def test_missing_rows_are_left_out_and_listed(measure):
    without, orbit = measure().measurements, measure("missing=5%")
    number = round(0.05 * len(without))
    assert len(orbit.measurements) == len(without) - number
    assert len(orbit.affected) == number
    kept = without.merge(orbit.affected[KEY], how="left", on=KEY, indicator=True)["_merge"]
    expected = without[(kept == "left_only").to_numpy()].reset_index(drop=True)
    pd.testing.assert_frame_equal(orbit.measurements, expected)
