"""The tables of the Survey and Source pages."""

import math

import numpy as np
import pandas as pd
import pytest

from plateviz.tables import (
    motion_in_words,
    motion_table,
    orbit_list,
    orbit_states,
    run_strip,
    source_class,
    source_list,
    source_orbits,
    source_strip,
)


def values(items):
    return {item.label: item.value for item in items}


def states(items):
    return {item.label: item.state for item in items}


def test_orbits_have_dates_that_sort_and_keep_their_order(survey):
    table = orbit_list(survey.orbits)
    assert table["orbit_id"].tolist() == survey.orbits["orbit_id"].tolist()
    dates = table.loc[survey.orbits["epoch"].notna(), "date"]
    assert dates.str.fullmatch(r"\d{4}-\d\d-\d\d \d\d:\d\d").all()
    assert dates.is_monotonic_increasing


def test_date_is_that_of_the_epoch(survey):
    # MJD 51544.5 is the noon of 1 January 2000.
    orbits = survey.orbits.iloc[:2].assign(epoch=[51544.5, np.nan])
    assert orbit_list(orbits)["date"].tolist() == ["2000-01-01 12:00", ""]


def test_each_number_is_judged_by_its_expected_scatter(survey):
    row = survey.orbits[survey.orbits["status"] == "complete"].iloc[[0, 0, 0]]
    scatter = math.sqrt(2.0 / row["dof"].iloc[0])
    orbits = row.assign(
        chi2_per_dof=[1.0 + 2.0 * scatter, 1.0 + 4.0 * scatter, 1.3],
        converged=[1.0, 0.0, 1.0],
        status=["complete", "complete", "failed"],
    )
    judged = orbit_states(orbits)
    assert judged["chi2_per_dof"].tolist() == ["good", "warn", "bad"]
    assert judged["iterations"].tolist() == ["neutral", "bad", "neutral"]
    assert judged["status"].tolist() == ["good", "good", "bad"]


def test_missing_numbers_are_not_judged(survey):
    failed = survey.orbits[survey.orbits["status"] != "complete"]
    judged = orbit_states(failed)
    assert set(judged["chi2_per_dof"]) | set(judged["normalised_deviation_ra"]) == {"neutral"}


def test_run_strip_summarises_the_orbits_and_motions(survey):
    items = run_strip(survey.orbits, survey.motions)
    failed = int((survey.orbits["status"] == "failed").sum())
    assert values(items)["Orbits failed"] == f"{failed}"
    assert states(items)["Orbits failed"] == "bad"
    assert values(items)["Orbits complete"].endswith(f"(of {len(survey.orbits)})")
    fitted = int(survey.motions["fit_pmra"].notna().sum())
    assert values(items)["Motions fitted"] == f"{fitted} (of {len(survey.motions)})"


@pytest.mark.parametrize(("chi2", "state"), [(1.0, "good"), (1.1, "warn"), (1.3, "bad")])
def test_chi2_of_a_run_is_judged_by_its_median(survey, chi2, state):
    row = survey.orbits[survey.orbits["status"] == "complete"].iloc[[0, 0, 0]]
    orbits = row.assign(chi2_per_dof=[0.5, chi2, 2.0])
    assert states(run_strip(orbits, survey.motions))["χ² per degree of freedom"] == state


def test_run_strip_of_a_run_without_orbits_has_no_numbers(survey):
    orbits = survey.orbits.assign(status="missing", chi2_per_dof=np.nan, n_measurements=np.nan)
    found = values(run_strip(orbits, survey.motions.iloc[:0]))
    assert found["Motions fitted"] == "none yet"
    assert found["χ² per degree of freedom"] == "–"
    assert found["Orbits missing"] == str(len(orbits))


def test_motion_table_has_fit_truth_and_uncertainties(survey):
    history, motion = survey.source("reference")
    table = motion_table(history, motion).set_index("parameter")
    assert table.loc["parallax", "fit"] == motion["fit_parallax"]
    assert table.loc["proper motion in δ", "pull"] == motion["pull_pmdec"]
    assert table["unit"].tolist() == ["mas", "mas", "mas", "mas/yr", "mas/yr"]
    assert table["sigma"].to_numpy() == pytest.approx(
        np.hypot(table["sigma_noise"], table["sigma_catalogue"]), rel=1e-6
    )


def test_motion_in_words_has_the_decimals_that_the_uncertainties_justify():
    one = {"parameter": "parallax", "unit": "µas", "value": 314900.387, "fit": -54.515}
    rest = {"sigma_noise": 58.2, "sigma_catalogue": 2.767, "true": math.nan, "pull": 1.171}
    rows = [{**one, **rest, "sigma": sigma} for sigma in (58.26, 0.0583, 0.26, 4.21, math.nan)]
    words = motion_in_words(pd.DataFrame(rows))
    assert words["fitted"].tolist() == [
        *("314,900", "314,900.387", "314,900.39", "314,900.4", "314,900.387")
    ]
    assert words.iloc[0].tolist() == [
        *("parallax", "µas", "314,900", "−55", "58", "3", "58", "1.171")
    ]


def test_parallax_and_proper_motion_have_values_of_their_own(survey):
    history, motion = survey.source("reference")
    listed = survey.catalogue.set_index("source_id").loc[history["source_id"].iloc[0]]
    table = motion_table(history, motion)
    expected = [listed[name] + motion[f"fit_{name}"] for name in ("parallax", "pmra", "pmdec")]
    # A hundredth of a microarcsecond: the catalogue's motion is read off its positions.
    np.testing.assert_allclose(table["value"], [np.nan, np.nan, *expected], atol=1e-5)
    found = values(source_strip(history, motion))["Parallax"]
    assert found == f"{expected[0]:.3f} mas (± {motion['sigma_parallax']:.3f} mas)"


def test_a_source_of_one_orbit_has_no_parallax(survey):
    history, motion = survey.source("reference")
    assert values(source_strip(history.iloc[:1], motion))["Parallax"] == "–"


def test_source_strip_shows_only_known_numbers(survey):
    history, motion = survey.source("artificial")
    found = values(source_strip(history, motion))
    assert found["Orbits"] == f"{len(history)} (in {motion['span']:.2f} yr)"
    assert found["Rms from the truth"] == f"{motion['rms_truth_2d']:.3f} mas"
    assert set(values(source_strip(history, None))) == {"Orbits", "Measurements"}


def test_source_with_few_orbits_has_no_chi2_of_the_motion(survey):
    history, motion = survey.source("reference")
    few = motion.copy()
    few[["chi2", "dof", "scatter_ra", "rms_truth_2d"]] = [np.nan, 0, np.nan, np.nan]
    strip = source_strip(history, few)
    found = values(strip)
    assert (found["χ² of the motion"], found["Scatter in α"]) == ("–", "–")
    assert all(item.hint.startswith("Too few orbits") for item in strip if item.value == "–")
    assert "Rms from the truth" not in found


@pytest.mark.parametrize(
    ("kind", "name"),
    [("reference", "reference"), ("artificial", "artificial"), ("other", "non-reference")],
)
def test_source_class_has_its_name(survey, kind, name):
    assert source_class(survey.source(kind)[0]) == name


def test_deviation_is_from_the_truth(survey):
    history, _ = survey.source("reference")
    table = source_orbits(history)
    expected = history["offset_ra"] - history["true_offset_ra"]
    assert table["deviation_ra"].to_numpy() == pytest.approx(expected.to_numpy())
    without = source_orbits(history.assign(true_offset_ra=np.nan))
    assert without["deviation_ra"].isna().all()


def test_source_without_degrees_of_freedom_has_no_chi2(survey):
    history, _ = survey.source("reference")
    table = source_orbits(history.assign(dof=0.0))
    assert table["chi2_per_dof"].isna().all()


def test_sources_with_most_orbits_come_first():
    counts = pd.DataFrame(
        {
            "source_id": [2**53 + 1, 7, 8],
            "is_reference": [False, True, False],
            "is_artificial": [False, False, True],
            "n_orbits": [3, 5, 5],
            "n_obs": [90, 80, 81],
        }
    )
    table = source_list(counts)
    assert table["id"].tolist() == ["8", "7", str(2**53 + 1)]
    assert table["source_class"].tolist() == ["artificial", "reference", "non-reference"]
