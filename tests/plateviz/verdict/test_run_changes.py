"""What differs between two runs: settings, figures of merit, and motions source by source."""

import numpy as np
import pandas as pd
import pytest

from plateviz.tables import motion_differences, shared_motions
from plateviz.tables.run_diagnosis import no_tests
from plateviz.verdict.run_changes import ComparedRun, run_changes
from plateviz.verdict.verdict import Verdict
from solver.data.settings import FitSettings
from solver.data.survey_schema import MOTION_PARAMETERS

GOOD = Verdict("good", "This run can be trusted.", [], [])
BAD = Verdict("bad", "This run should not be trusted as it is.", [], [])


@pytest.fixture(scope="module")
def shifted(survey):
    """The motions with parallaxes that are larger by one sigma, and sigmas twice as large."""
    table = survey.motions.copy()
    table["fit_parallax"] += table["sigma_parallax"]
    for name in MOTION_PARAMETERS:
        table[f"sigma_{name}"] *= 2.0
    return table


def compared(survey, motions, name="a", settings=None, verdict=GOOD):
    return ComparedRun(name, settings or FitSettings(), survey.orbits, motions, no_tests(), verdict)


def rows_of(a, b):
    return run_changes(a, b).set_index("what")


def test_differences_are_over_the_larger_sigma_of_the_two(survey, shifted):
    for a, b, sign in ((survey.motions, shifted, 1.0), (shifted, survey.motions, -1.0)):
        table = motion_differences(shared_motions(a, b))
        assert np.allclose(table["over_sigma_parallax"], 0.5 * sign)
        assert np.allclose(table["sigma_ratio_parallax"], 2.0**sign)
        assert np.allclose(table["difference_pmra"], 0.0)


def test_sources_are_matched_by_their_id_and_counted_otherwise(survey):
    fitted = survey.motions[survey.motions["fit_pmra"].notna()]
    a, b = fitted.iloc[:-2], fitted.iloc[::-1].iloc[:-3]
    shared = shared_motions(a, b)
    assert (shared.only_a, shared.only_b) == (3, 2)
    assert len(shared.a) == len(shared.b) == len(fitted) - 5
    table = motion_differences(shared)
    assert set(table["source_id"]) == set(a["source_id"]) & set(b["source_id"])
    assert (table["difference_ra"] == 0.0).all()
    assert table["id"].tolist() == table["source_id"].astype(str).tolist()


def test_source_without_a_motion_in_a_run_is_not_compared(survey):
    without = survey.motions["fit_pmra"].isna()
    assert without.any()
    table = motion_differences(shared_motions(survey.motions, survey.motions))
    assert not set(survey.motions["source_id"][without]) & set(table["source_id"])


def test_position_is_compared_at_one_epoch(survey):
    later = survey.motions.assign(epoch=survey.motions["epoch"] + 2.0)
    later["fit_ra"] += 2.0 * later["fit_pmra"]
    later["fit_dec"] += 2.0 * later["fit_pmdec"]
    table = motion_differences(shared_motions(survey.motions, later))
    assert np.allclose(table[["difference_ra", "difference_dec"]], 0.0, atol=1e-9)
    # What the proper motion adds to the uncertainty counts.
    assert (table["sigma_ratio_ra"] < 1.0).all()


def test_changed_settings_and_verdicts_are_rows(survey):
    a = compared(survey, survey.motions, "default", FitSettings(order=5))
    b = compared(survey, survey.motions, "low", FitSettings(order=3), BAD)
    rows = rows_of(a, b)
    assert rows.loc["Run"].tolist() == ["default", "low", ""]
    assert rows.loc["Distortion order"].tolist() == ["order 5", "order 3", ""]
    assert rows.loc["Verdict"].tolist() == ["can be trusted", "not to be trusted", ""]
    assert "Distortion order" not in rows_of(a, a).index


def test_figures_of_merit_are_of_the_sources_in_both(survey, shifted):
    rows = rows_of(compared(survey, survey.motions), compared(survey, shifted))
    both = shared_motions(survey.motions, shifted)
    chosen = both.b["source_class"] != "reference"
    assert rows.loc["Compared below: non-reference sources", "change"] == str(int(chosen.sum()))
    of_a, of_b, change = rows.loc["Median σ of parallax (mas)"]
    expected = float(both.a.loc[chosen, "sigma_parallax"].median())
    assert float(of_a) == pytest.approx(expected, abs=5e-5)
    assert float(of_b) == pytest.approx(2.0 * expected, abs=5e-5)
    assert float(change) == pytest.approx(expected, abs=5e-5)
    assert rows.loc["Rms difference of parallax / larger σ", "change"] == "0.500"
    assert rows.loc["Rms pull against truth, position in δ", "change"] == "+0.000"
    n = int((survey.orbits["status"] == "complete").sum())
    assert rows.loc["Orbits fitted"].tolist() == [str(n), str(n), "0"]
    assert rows.loc["Orbits failed"].tolist() == ["2", "2", "0"]


def test_run_without_a_truth_has_no_pulls(survey):
    pulls = {f"pull_{name}": np.nan for name in MOTION_PARAMETERS}
    run = compared(survey, survey.motions.assign(**pulls))
    assert not any("pull" in what for what in rows_of(run, run).index)


def test_states_of_the_orbits_are_counted(survey):
    causes = pd.DataFrame({"orbit_id": [0, 0, 1, 2], "state": ["bad", "bad", "good", "warn"]})
    tests = no_tests()
    flawed = compared(survey, survey.motions)._replace(
        tests=type(tests)(tests.calibrations, tests.orbit_tests, causes, tests.zonal)
    )
    rows = rows_of(compared(survey, survey.motions), flawed)
    assert rows.loc["Orbits not to be trusted"].tolist() == ["0", "1", "+1"]
    assert rows.loc["Orbits to be used with care"].tolist() == ["0", "1", "+1"]


def test_run_that_is_not_gathered_has_its_orbits_only(survey):
    growing = compared(survey, survey.motions.head(0))
    rows = rows_of(compared(survey, survey.motions), growing)
    assert rows.loc["Sources with a fitted motion", "b"] == "0"
    assert "Compared below: non-reference sources" not in rows.index
    assert rows.loc["Orbits fitted", "change"] == "0"
