"""A robust fit finds swapped identifications and leaves the other sources as they are."""

from dataclasses import replace

import numpy as np
import pytest

from plateviz.tables.outliers import EXCHANGED, outlier_list
from solver.data.settings import FitSettings
from solver.fit import fit_orbit
from solver.simulate.settings import SurveySettings
from tests.campaigns import identifications
from tests.campaigns.defects import defective_orbit
from tests.campaigns.identifications import compared, row, sigmas_moved, trial
from tests.campaigns.trials import run_trials

# As `small_survey`, whose fits are compiled for other tests, too.
SETTINGS = SurveySettings(orbits=2, seed=3).scaled(4000)
KEY = ["field_id", "plate_id", "detector_id", "source_id"]
ROBUST = FitSettings(robust=True)

pytestmark = pytest.mark.slow


def rows_of(table):
    return set(table[KEY].itertuples(index=False, name=None))


@pytest.fixture(scope="module")
def swapped():
    """A robust fit, its orbit, and the measurements that have the identification of another."""
    data, affected = defective_orbit(replace(SETTINGS, defects=("swapped=1%",)), 0)
    return fit_orbit(data, settings=ROBUST), data, affected


@pytest.fixture(scope="module")
def clean():
    data, _ = defective_orbit(SETTINGS, 0)
    return fit_orbit(data, settings=ROBUST), data


def test_robust_fit_lists_swapped_identifications_and_no_good_ones(swapped):
    result, data, affected = swapped
    assert result.summary["converged"]
    wrong, listed = rows_of(affected), rows_of(result.outliers)
    assert len(wrong) > 50
    assert len(wrong & listed) >= 0.95 * len(wrong)
    assert len(listed - wrong) < 0.01 * (len(data.measurements) - len(wrong))


def test_list_names_the_source_that_was_measured(swapped):
    result, _, affected = swapped
    true = affected.set_index(KEY)["true_source_id"].astype(str)
    found = outlier_list(result).set_index(result.outliers.set_index(KEY).index)[EXCHANGED]
    assert (found.reindex(true.index) == true).mean() >= 0.95


def test_positions_of_other_sources_are_unharmed(swapped, clean):
    found = compared(*swapped, *clean)
    assert found["others"] > 100
    assert found["pull_others"] == pytest.approx(1.0, abs=0.1)
    assert found["pull_others"] == pytest.approx(found["pull_others_without"], abs=0.03)
    assert found["pull_all"] == pytest.approx(1.0, abs=0.1)
    assert found["shift_others"] < 0.1


def test_campaign_counts_what_is_listed(swapped, clean):
    result, data, affected = swapped
    # A list without the first of the swapped measurements, and with a good one.
    fewer = result.outliers[result.outliers.index > 0]
    good = data.measurements[~data.measurements["source_id"].isin(affected["source_id"])]
    listed = fewer.copy()
    listed.iloc[-1, [listed.columns.get_loc(name) for name in KEY]] = good[KEY].iloc[0]
    found = compared(replace(result, outliers=listed), data, affected, *clean)
    assert found["swapped"] == len(affected)
    assert found["good"] == len(data.measurements) - len(affected)
    assert found["listed"] == found["visible_listed"] == len(rows_of(affected) & rows_of(listed))
    assert found["good_listed"] == 1


def test_measurement_that_is_hardly_moved_is_hidden(swapped, clean):
    _, data, affected = swapped
    keys = identifications.keys(affected)
    moved = sigmas_moved(data.measurements, clean[1].measurements, keys)
    assert (moved > identifications.VISIBLE).all()
    near = data.measurements.set_index(KEY)
    before = clean[1].measurements.set_index(KEY)
    near["nx"] = before["nx"] + 3.0 * before["sx"]
    near["ny"] = before["ny"] - 4.0 * before["sy"]
    np.testing.assert_allclose(
        sigmas_moved(near.reset_index(), clean[1].measurements, keys), 5.0, rtol=1e-9
    )


def test_campaign_goes_on_and_prints_its_table(monkeypatch, tmp_path, swapped, clean):
    found = compared(*swapped, *clean)
    monkeypatch.setattr(identifications, "scores", lambda *_: found)
    path = tmp_path / "records.jsonl"
    records = run_trials(path, [1000], trial)
    assert run_trials(path, [1000], lambda _: pytest.fail("ran again")) == records
    cells = row("1 sparse", 1.0, records).strip("| ").split(" | ")
    assert cells[:3] == ["1 sparse", "1.0 %", "1 of 1"]
    assert cells[5] == "100 %"
    assert len(cells) == 12
    assert row("1 sparse", 1.0, [{"failed": "no"}]).count("|") == 13
