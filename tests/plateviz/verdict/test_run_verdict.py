import json

import numpy as np
import pandas as pd
import pytest

from plateviz.tables.run_diagnosis import RunTests, diagnose_run, no_tests
from plateviz.verdict.run_verdict import run_verdict
from plateviz.verdict.verdict import as_plain
from tests.plateviz.run_tables import N_ORBITS, calibrations, causes, orbit_tests, zonal


def tables(**changes):
    whole = {
        "calibrations": calibrations(),
        "orbit_tests": orbit_tests(),
        "orbit_causes": causes(),
        "zonal": zonal(11.0),
    }
    return RunTests(**whole | changes)


@pytest.fixture(scope="module")
def good(survey):
    """A run of which all orbits are fitted, and its motions, which scatter as they should."""
    complete = survey.orbits[survey.orbits["status"] == "complete"].head(N_ORBITS)
    motions = survey.motions.copy()
    motions["chi2"] = motions["dof"].astype(float)
    return complete.assign(orbit_id=range(N_ORBITS)), motions


def judged(good, **changes):
    return run_verdict(*good, tables(**changes))


def test_good_run_is_trusted_with_all_its_tests(good):
    verdict = judged(good)
    assert (verdict.state, verdict.headline) == ("good", "This run can be trusted.")
    assert not verdict.causes
    # Two shares, five tests of the orbits and the furthest, trend and jump, smooth errors, two
    # kinds of source, and most sources.
    assert len(verdict.tests) == 14
    assert not any(test.is_found for test in verdict.tests)
    assert any("0.15 mas along each axis" in sentence for sentence in verdict.reasons)


def test_smooth_errors_of_the_catalogue_are_named_with_what_they_spoil(good):
    verdict = judged(good, zonal=zonal(80.0))
    assert verdict.state == "bad"
    (cause,) = verdict.causes
    assert (cause.name, cause.is_large) == ("zonal-errors", True)
    assert verdict.headline.endswith(f"{cause.title}.")
    assert "about 0.4 mas" in cause.spoils
    name, value = cause.options[0].removeprefix("--prior ").split("=")
    assert name == "sources"
    assert float(value) > 1.0


def test_smooth_errors_beside_a_more_certain_cause_are_not_passed_over(good):
    drifting = {"orbit_causes": causes(30), "orbit_tests": orbit_tests(5.0)}
    verdict = judged(good, zonal=zonal(80.0), **drifting)
    assert [cause.name for cause in verdict.causes] == ["distortion-drifts"]
    (sentence,) = (one for one in verdict.reasons if "smooth errors" in one.lower())
    assert "may have smooth errors as well, of about 0.4 mas" in sentence
    (sentence,) = (one for one in judged(good, **drifting).reasons if "Smooth errors" in one)
    assert "would be seen in half" in sentence
    assert "No orbit shows a shift" in sentence


def test_cause_that_many_orbits_name_is_that_of_the_run(good):
    verdict = judged(good, orbit_causes=causes(30), orbit_tests=orbit_tests(5.0))
    assert verdict.state == "bad"
    assert [cause.name for cause in verdict.causes] == ["distortion-drifts"]
    cause = verdict.causes[0]
    assert cause.title == "in many orbits, the distortion drifts"
    assert "The terms of the second degree change steadily. It spoils" in cause.spoils
    assert cause.options == ("--drift 2",)
    assert "30 of 40 orbits" in cause.words
    assert cause.significance == pytest.approx(6.0 * np.sqrt(30))
    of_catalogue = causes(30).replace("distortion-drifts", "wrong-epoch")
    (cause,) = judged(good, orbit_causes=of_catalogue, orbit_tests=orbit_tests(5.0)).causes
    assert cause.significance == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("n_drifting", "headline"),
    [
        (1, "This run should not be trusted as it is: the distortion drifts."),
        (0, "This run can be trusted."),
    ],
)
def test_run_of_one_orbit_is_as_good_as_that(good, n_drifting, headline):
    orbits, motions = good
    only = tables(
        calibrations=calibrations().head(0),
        orbit_tests=orbit_tests().head(5),
        orbit_causes=causes(n_drifting).head(1),
        zonal=zonal(11.0).head(0),
    )
    verdict = run_verdict(orbits.head(1), motions.head(0), only)
    assert verdict.headline == headline
    assert verdict.state == ("bad" if n_drifting else "good")
    assert any("in its verdict" in sentence for sentence in verdict.reasons)
    # A median and a range of one number would say nothing.
    (chi2,) = (sentence for sentence in verdict.reasons if "χ² per degree" in sentence)
    assert chi2.startswith("The only orbit has a solution, which converged; its χ²")


def test_orbit_that_names_a_cause_twice_counts_once(good):
    several = causes(4)
    again = several[several["orbit_id"] < 4].assign(significance=5.0, title="another")
    doubled = pd.concat([again, several]).sort_values("orbit_id", kind="stable")
    verdict = judged(good, orbit_causes=doubled, orbit_tests=orbit_tests(5.0))
    (cause,) = (one for one in verdict.causes if one.name == "distortion-drifts")
    assert "4 of 40 orbits name it (0, 1, 2, 3)" in cause.words
    assert cause.significance == pytest.approx(6.0 * np.sqrt(4))
    assert cause.title == "in many orbits, the distortion drifts"


def test_two_causes_of_one_name_in_one_orbit_are_no_cause_of_the_run(good):
    one = causes(1)
    doubled = pd.concat([one, *[one[one["orbit_id"] == 0]] * 4]).sort_values("orbit_id")
    verdict = judged(good, orbit_causes=doubled, orbit_tests=orbit_tests(5.0))
    assert "distortion-drifts" not in [cause.name for cause in verdict.causes]


def test_jump_is_said_at_its_orbit_though_orbits_lack_its_group(good):
    table = calibrations()
    later = (table["orbit_id"] >= 20) & (table["label"] == "A 1 1")
    table.loc[later, "value"] += 20.0
    others = table[table["orbit_id"] < 3].assign(group="another group")
    # As where some orbits lack what others have.
    verdict = judged(good, calibrations=pd.concat([others, table[table["orbit_id"] >= 3]]))
    (cause,) = (one for one in verdict.causes if one.name == "calibration-jump")
    assert "at orbit 20," in cause.words


@pytest.mark.parametrize("of_references", [True, False], ids=["only references", "no motions"])
def test_smooth_errors_are_named_without_motions_of_other_sources(good, of_references):
    orbits, motions = good
    known = motions[motions["is_reference"]] if of_references else motions.iloc[:0].astype(object)
    verdict = run_verdict(orbits, known, tables(zonal=zonal(80.0)))
    (cause,) = (one for one in verdict.causes if one.name == "zonal-errors")
    assert "nan" not in cause.sentence()
    assert cause.is_large == of_references


def test_single_bad_orbit_is_named_but_no_flaw_of_the_run(good):
    verdict = judged(good, orbit_causes=causes(1))
    assert verdict.state == "good"
    assert "Solutions not to be trusted: orbit 0." in verdict.notable


def test_orbit_that_is_far_off_is_named(good):
    tests = orbit_tests()
    tests.loc[tests["orbit_id"] == 7, "sigma"] = [9.0, 1.0, 1.0, 1.0, 1.0]
    verdict = judged(good, orbit_tests=tests)
    assert verdict.state == "warn"
    assert "flawed-orbit" in [cause.name for cause in verdict.causes]
    (cause,) = (one for one in verdict.causes if one.name == "flawed-orbit")
    assert cause.title == "orbit 7 has a flaw"
    assert "“noise”" in cause.words


def test_number_far_off_in_an_orbit_without_a_verdict_is_a_fault(good):
    orbits, motions = good
    off = orbits.copy()
    off.loc[off.index[3], "normalised_deviation_ra"] *= 1.5
    known = causes()
    known = known[known["orbit_id"] != off["orbit_id"].iloc[3]]
    assert run_verdict(off, motions, tables(orbit_causes=known)).state == "bad"


def test_number_far_off_in_one_of_many_orbits_is_chance(good):
    orbits, motions = good
    row = orbits.index[3]
    off = orbits.copy()
    off.loc[row, "normalised_deviation_ra"] *= 1.5
    verdict = run_verdict(off, motions, tables())
    assert verdict.state == "good"
    assert any("far from their expected values" in sentence for sentence in verdict.notable)


def test_weak_flaw_of_all_orbits_is_seen_in_all_together(good):
    verdict = judged(good, orbit_tests=orbit_tests(1.0))
    assert verdict.state == "warn"
    (cause,) = verdict.causes
    assert cause.name == "weak-in-each-orbit"
    assert cause.title.endswith(": noise")


def test_trend_of_the_calibration_needs_care_and_spoils_no_position(good):
    verdict = judged(good, calibrations=calibrations(0.2))
    assert verdict.state == "warn"
    assert verdict.causes[0].name == "calibration-trend"
    assert "A 1 1" in verdict.causes[0].words
    assert "no position" in verdict.causes[0].spoils


def with_a_source_that_scatters(motions, ratio):
    """Return motions of which one, of no reference star, has a chi2 so many times too large."""
    motions = motions.copy()
    row = motions.index[(motions["dof"] > 20) & ~motions["is_reference"]][0]
    motions.loc[row, "chi2"] = ratio * motions.loc[row, "dof"]
    return motions, str(motions.loc[row, "source_id"])


def test_source_that_scatters_is_named(good):
    orbits, motions = good
    motions, name = with_a_source_that_scatters(motions, 20.0)
    verdict = run_verdict(orbits, motions, tables())
    assert verdict.causes[0].name == "source-scatters"
    assert name in verdict.causes[0].title


def test_source_that_scatters_is_named_after_what_spoils_all_orbits(good):
    orbits, motions = good
    motions, name = with_a_source_that_scatters(motions, 1000.0)
    drifting = tables(orbit_causes=causes(30), orbit_tests=orbit_tests(5.0))
    verdict = run_verdict(orbits, motions, drifting)
    assert [one.name for one in verdict.causes] == ["distortion-drifts", "source-scatters"]
    # However far off the star is, it neither leads nor hides the other.
    assert verdict.causes[1].significance > 2.0 * verdict.causes[0].significance
    assert verdict.headline.endswith(": in many orbits, the distortion drifts.")
    assert name in verdict.causes[1].title


@pytest.mark.parametrize(("share", "state"), [(1.0, "good"), (1.45, "warn"), (2.5, "bad")])
def test_most_sources_that_scatter_are_a_fault_of_the_run(good, share, state):
    orbits, motions = good
    noise = np.random.default_rng(3).chisquare(motions["dof"].clip(lower=1))
    states = causes(1)
    verdict = run_verdict(orbits, motions.assign(chi2=share * noise), tables(orbit_causes=states))
    assert verdict.state == state
    if state != "good":
        assert verdict.causes[0].name == "scattered-motions"
        assert "source-scatters" not in {cause.name for cause in verdict.causes}
        assert "The solutions of orbit 0 should not be trusted" in verdict.causes[0].words


def test_what_orbits_share_is_not_multiplied(good):
    """The other stars of the catalogue and the distortion are the same in all orbits."""
    names = (
        "other stars beyond the median of their errors",
        "values of pitch_x against their prior",
    )
    rows = [
        pd.DataFrame({"orbit_id": range(N_ORBITS), "name": name, "sigma": 2.0}) for name in names
    ]
    shared = pd.concat([orbit_tests(), *rows], ignore_index=True)
    diagnosis = diagnose_run(good[1], tables(orbit_tests=shared))
    found = {test.name: test.sigma for test in diagnosis.tests}
    assert all(found[f"all orbits: {name}"] < 0.5 for name in names)


def test_weaker_cause_that_the_first_may_bring_about_is_not_named(good):
    verdict = judged(
        good,
        zonal=zonal(41.0),
        orbit_causes=causes(40),
        orbit_tests=orbit_tests(5.0),
    )
    assert [cause.name for cause in verdict.causes] == ["distortion-drifts"]
    assert sum(test.is_found for test in verdict.tests) > 2


def test_tests_of_reference_stars_are_not_multiplied(good):
    """All orbits have the same stars, whose errors all of them find."""
    shared = orbit_tests()
    shared.loc[shared["name"] == "reference stars, all, α", "sigma"] = 2.0
    diagnosis = diagnose_run(good[1], tables(orbit_tests=shared))
    found = {test.name: test.sigma for test in diagnosis.tests}
    assert found["all orbits: reference stars, all, α"] < 0.5


@pytest.mark.parametrize("seed", range(20))
def test_good_orbits_together_are_within_chance(good, seed):
    diagnosis = diagnose_run(good[1], tables(orbit_tests=orbit_tests(seed=100 + seed)))
    assert not diagnosis.found(0.002)


def test_run_that_was_not_tested_says_so(good):
    verdict = run_verdict(*good, no_tests())
    assert any("not been tested as a whole" in sentence for sentence in verdict.reasons)
    assert verdict.state == "warn"
    assert verdict.headline.endswith("it has not been tested as a whole.")
    assert any("not looked for" in sentence for sentence in verdict.reasons)


def test_verdict_is_plain_for_json(good):
    plain = json.loads(json.dumps(as_plain(judged(good, zonal=zonal(80.0)))))
    assert plain["causes"][0]["name"] == "zonal-errors"
    assert {"state", "headline", "causes", "tests", "reasons"} <= set(plain)


def test_run_names_its_failed_orbits_by_reason(survey):
    reasons = {11: "orbit 11: too few measurements", 12: "orbit 12: a direction is open"}
    named = survey.orbits.assign(message=survey.orbits["orbit_id"].map(reasons).fillna(""))
    verdict = run_verdict(named, survey.motions, no_tests())
    assert verdict.state == "bad"
    assert f": 2 of {len(named)} orbits have no solution." in verdict.headline
    failed = [sentence for sentence in verdict.notable if "has no solution" in sentence]
    assert failed == [
        "Orbit 11 has no solution: too few measurements",
        "Orbit 12 has no solution: a direction is open",
    ]
    alike = named.assign(message=[f"orbit {n}: too few" for n in named["orbit_id"]])
    verdict = run_verdict(alike, survey.motions, no_tests())
    assert "Orbits 11, 12 have no solution: too few" in verdict.notable


def test_run_without_a_solution_says_why_and_nothing_of_tests(survey):
    orbits = survey.orbits.assign(status="failed")
    swapped = "orbit {}: Measurements have each other's identification: ... (--robust)"
    orbits["message"] = [swapped.format(n) for n in orbits["orbit_id"]]
    verdict = run_verdict(orbits, survey.motions.head(0), no_tests())
    assert verdict.headline.endswith("as it is: no orbit has a solution.")
    assert verdict.faults == ["No orbit has a solution."]
    assert verdict.reasons == ["No orbit has a solution."]
    (why,) = verdict.notable
    assert why.startswith(f"{len(orbits)} orbits, among them 0, 1, ")
    assert why.endswith(
        "have no solution: Measurements have each other's identification: ... (--robust)"
    )


@pytest.mark.parametrize(
    ("n_bad", "text"),
    [(1, "values: orbit 0."), (2, "values: orbits 0, 1."), (30, "30 orbits, among them 0, 1,")],
)
def test_orbits_far_off_are_named(survey, n_bad, text):
    orbits = pd.concat([survey.orbits[survey.orbits["status"] == "complete"].head(1)] * 40)
    orbits = orbits.assign(orbit_id=range(40)).reset_index(drop=True)
    orbits.loc[orbits["orbit_id"] < n_bad, "chi2_per_dof"] = 9.0
    verdict = run_verdict(orbits, survey.motions, no_tests())
    assert any(text in sentence for sentence in verdict.notable)


def test_run_without_fitted_orbits_is_reported(survey):
    none = survey.orbits.assign(status="missing")
    verdict = run_verdict(none, survey.motions.iloc[:0], no_tests())
    assert "No orbit has a solution." in verdict.reasons
