"""Table of the trends of a run's calibration."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from plateviz.tables import run_diagnosis
from plateviz.tables.calibration_trends import calibration_trends
from plateviz.tables.run_diagnosis import diagnose_run, no_tests
from tests.plateviz.run_tables import N_ORBITS, calibrations


def trends_of(table):
    return calibration_trends(replace(no_tests(), calibrations=table))


def test_trend_is_that_of_the_parameter_that_changes_most():
    table = trends_of(calibrations(0.2))
    assert set(table["group"]) == {"distortion, degree 2"}
    assert set(table["label"]) == {"A 1 1"}
    assert len(table) == N_ORBITS
    assert table["change"].iloc[0] == pytest.approx(0.2 * (N_ORBITS - 1), rel=0.2)
    assert np.ptp(table["trend"]) == pytest.approx(table["change"].iloc[0])
    assert table["offset"].mean() == pytest.approx(0.0, abs=1e-12)
    assert table["scatter"].iloc[0] == pytest.approx(1.0, rel=0.3)
    assert table["sigma"].iloc[0] > 5.0
    assert set(table["season"]) == {1, -1}


def test_verdict_and_table_share_their_tests(monkeypatch):
    made, make = [], run_diagnosis.all_series
    monkeypatch.setattr(run_diagnosis, "all_series", lambda one: made.append(one) or make(one))
    tests = replace(no_tests(), calibrations=calibrations(0.2))
    assert diagnose_run(pd.DataFrame(), tests).trends
    assert len(calibration_trends(tests))
    assert len(made) == 1


def test_no_or_few_orbits_have_no_trends():
    table = calibrations()
    assert trends_of(table.iloc[:0]).empty
    assert trends_of(table[table["orbit_id"] < 5]).empty
