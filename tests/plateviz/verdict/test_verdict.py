"""Verdicts on solutions with a known flaw."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import chdtri

from plateviz.plots.residuals.solution_tests import plot_solution_tests
from plateviz.verdict import verdict
from plateviz.verdict.solution_tests import solution_tests
from plateviz.verdict.verdict import (
    as_plain,
    is_judged,
    orbit_verdict,
    source_verdict,
    with_verdict,
    worst,
)
from solver.results.diagnosis.causes import find_causes
from solver.results.diagnosis.found import Found
from solver.results.diagnosis.rate import discoveries, log_chance_normal
from solver.results.diagnosis.table import CARE_RATE, diagnose
from tests.solver.results.test_diagnosis import fitted


def with_summary(result, **values):
    return replace(result, summary={**result.summary, **values})


@pytest.mark.parametrize(
    ("states", "expected"),
    [
        ([], "good"),
        (["good", "neutral"], "good"),
        (["warn", "good"], "warn"),
        (["warn", "bad"], "bad"),
    ],
)
def test_worst_state_decides(states, expected):
    assert worst(states) == expected


def with_chances(monkeypatch, fit_result, **chances):
    """Return a result whose tests have these logarithms of their chance, by subject."""
    found = diagnose(fit_result)
    tests = [
        one._replace(
            log_chance=chances.get(one.subject, -0.7), sigma=8.0 * (one.subject in chances)
        )
        for one in found.tests
    ]
    monkeypatch.setattr(verdict, "diagnose", lambda _: found._replace(tests=tuple(tests)))
    return replace(fit_result)


def test_good_solution_can_be_trusted(monkeypatch, fit_result):
    judged = orbit_verdict(with_chances(monkeypatch, fit_result))
    assert judged.state == "good"
    assert judged.headline == "This solution can be trusted."
    assert judged.reasons[0].startswith("The fit converged after")
    assert judged.reasons[1].startswith(f"None of {len(judged.tests)} tests finds anything")
    assert not judged.causes
    assert not judged.faults


def test_solution_with_a_flaw_names_its_cause_first(monkeypatch, fit_result):
    judged = orbit_verdict(with_chances(monkeypatch, fit_result, stretch=-40.0))
    assert judged.state in ("warn", "bad")
    assert judged.causes
    assert judged.headline.endswith(f": {judged.causes[0].title}.")
    assert "What to do: " in judged.reasons[1]
    assert judged.faults[0].startswith(judged.causes[0].heading())


def test_rival_of_the_first_cause_is_said_in_the_headline_and_follows_it(monkeypatch, fit_result):
    judged = with_chances(monkeypatch, fit_result, stretch=-40.0)

    def with_a_rival(diagnosis):
        found = find_causes(diagnosis)
        (shear,) = (one for one in diagnosis.tests if one.subject == "shear")
        return found._replace(rivals=(Found(shear, 0.0),))

    monkeypatch.setattr(verdict, "find_causes", with_a_rival)
    judged = orbit_verdict(judged)
    first, rival = judged.causes[:2]
    assert (first.instead_of, rival.instead_of) == ("", first.name)
    assert judged.headline.endswith(f": {first.title}, or {rival.title}.")
    assert judged.reasons[2].startswith(f"Or, nearly as likely: {rival.title}")
    # None of the tests shows it.
    assert "sigma" not in judged.reasons[2].partition(". ")[0]
    weak = rival._replace(significance=3.4)
    assert weak.sentence().startswith(f"{weak.heading()}, 3 sigma. ")
    assert as_plain(judged)["causes"][1]["instead_of"] == first.name


def stuck_with(result, rows, factor):
    """Return a result that did not converge, with some residuals a factor larger."""
    residuals = result.residuals.copy()
    residuals.loc[residuals.index[rows], ["residual_x", "residual_y"]] *= factor
    return replace(with_summary(result, converged=False, reason="stuck"), residuals=residuals)


@pytest.mark.parametrize(
    ("factor", "state"), [(1.5, "good"), (4.0, "good"), (27.0, "warn"), (53.8, "bad")]
)
def test_catalogue_whose_errors_had_to_be_multiplied_by_much_is_not_trusted(
    monkeypatch, fit_result, factor, state
):
    good = with_chances(monkeypatch, fit_result)
    log_factor = {"references": float(np.log(factor))}
    entry = {"log_factor": log_factor, "sigma": {"references": 0.1}, "converged": True, "rounds": 3}
    settings = good.settings.with_(reference_scale=True)
    found = orbit_verdict(replace(with_summary(good, noise=entry), settings=settings))
    assert found.state == state
    names = [one.name for one in found.causes]
    assert names == ([] if state == "good" else ["wrong-catalogue"])
    assert ("much further from the catalogue" in found.headline) == (state != "good")


def test_noise_that_could_not_be_estimated_is_not_said_to_be_in_the_fit():
    result = fitted()
    residuals = result.residuals.copy()
    even = result.exposure_index % 2 == 0
    residuals.loc[even, ["residual_x", "residual_y"]] *= 2.0
    settings = result.settings.with_(noise_by_exposure=True)
    noisy = replace(result, residuals=residuals, settings=settings)
    first = orbit_verdict(noisy).causes[0]
    assert first.name == "noise-of-exposures"
    assert "--noise-by-exposure, but could not estimate the noise" in first.action
    assert not first.options


def test_fit_that_does_not_converge_says_what_helps(fit_result):
    stuck = stuck_with(fit_result, slice(None, None, 100), 1000.0)
    judged = orbit_verdict(stuck)
    assert judged.state == "bad"
    assert [cause.name for cause in judged.causes] == ["wild-measurements"]
    assert judged.causes[0].options == ("--robust",)
    robust = replace(stuck, settings=stuck.settings.with_(robust=True))
    assert [cause.name for cause in orbit_verdict(robust).causes] == ["not-converged"]


def test_catalogue_is_to_be_checked_where_the_measurements_of_reference_stars_are_far_off(
    fit_result,
):
    sources = fit_result.sources
    references = sources.loc[sources["is_reference"], "source_id"]
    is_one = fit_result.residuals["source_id"].isin(references).to_numpy()
    # Some of the measurements of each.
    rows = is_one & (np.arange(len(is_one)) % 3 == 0)
    stuck = stuck_with(fit_result, rows, 1000.0)
    [cause] = orbit_verdict(stuck).causes
    assert cause.title.startswith("the reference stars contradict the measurements")
    assert cause.action.startswith("check the proper motions, the epoch and the units")
    # Of few reference stars, the measurements are wrong.
    few = rows & fit_result.residuals["source_id"].isin(references[::4]).to_numpy()
    [cause] = orbit_verdict(stuck_with(fit_result, few, 1000.0)).causes
    assert cause.title.startswith("measurements that are far off")


def test_outliers_are_not_blamed_where_all_measurements_are_far_off(fit_result):
    [cause] = orbit_verdict(stuck_with(fit_result, slice(None), 100.0)).causes
    assert cause.name == "not-converged"
    assert "--robust" not in cause.options


def test_fit_that_does_not_converge_with_narrow_priors_is_to_have_the_usual_ones(fit_result):
    narrow = fit_result.settings.with_(prior_widths={"distortion_x": 1e-9})
    [cause] = orbit_verdict(
        stuck_with(replace(fit_result, settings=narrow), slice(None), 9.0)
    ).causes
    assert cause.name == "not-converged"
    assert "narrower than usual: distortion_x." in cause.words
    assert cause.options == ("--prior distortion_x=1um",)


def test_swapped_measurements_are_listed_where_they_prevent_a_solution(fit_result):
    residuals = fit_result.residuals.copy()
    at, residual = ["nx", "ny"], ["residual_x", "residual_y"]
    model = residuals[at].to_numpy() - residuals[residual].to_numpy()
    # The nearest neighbour of a measurement in its exposure, as in a wrong cross-match.
    key = ["field_id", "plate_id", "detector_id"]
    same = np.flatnonzero((residuals[key] == residuals.loc[0, key]).all(axis=1))
    first, second = same[np.argsort(np.hypot(*(model[same] - model[0]).T))[:2]]
    for one, other in ((first, second), (second, first)):
        residuals.loc[one, at] = model[other]
        residuals.loc[one, residual] = model[other] - model[one]
    stuck = replace(with_summary(fit_result, converged=False, reason="stuck"), residuals=residuals)
    [cause] = orbit_verdict(stuck).causes
    assert cause.name == "swapped"
    assert cause.options == ("--robust",)
    assert "In 1 pair, each is where the other should be" in cause.words
    assert str(residuals.loc[first, "source_id"]) in cause.words
    ids = residuals.loc[sorted((first, second)), "source_id"].tolist()
    field, exposure, detector = residuals.loc[0, key]
    where = f"field {field}, exposure {exposure}, detector {detector}"
    assert cause.items == (f"{ids[0]} and {ids[1]} in {where}",)
    again = orbit_verdict(replace(with_verdict(stuck)))
    assert again.causes[0] == cause


def test_fit_that_does_not_converge_has_the_remedy_of_what_its_residuals_look_like(
    monkeypatch, fit_result
):
    converged = with_chances(monkeypatch, fit_result, stretch=-40.0)
    expected = orbit_verdict(converged).causes[0]
    stuck = with_summary(converged, converged=False, reason="stuck")
    [cause] = orbit_verdict(stuck).causes
    assert cause.name == "not-converged"
    assert f"look as if {expected.title}" in cause.words
    assert cause.options == expected.options != ()


def test_verdict_of_a_result_is_read_again(fit_result):
    judged = with_verdict(fit_result)
    stored = json.loads(json.dumps(judged.summary))
    read = orbit_verdict(replace(judged, summary=stored))
    assert read == orbit_verdict(replace(fit_result))
    assert read.causes
    assert isinstance(read.causes[0].sentence(), str)


def test_result_is_judged_once_and_a_changed_one_anew(monkeypatch, fit_result):
    result = replace(fit_result)
    assert not is_judged(result)
    first = orbit_verdict(result)
    monkeypatch.setattr(verdict, "diagnose", lambda _: pytest.fail("judged again"))
    assert is_judged(result)
    assert orbit_verdict(result) is first
    assert not is_judged(with_summary(result, verdict={"state": "good"}))


def test_solution_that_has_not_converged_is_not_trusted(fit_result):
    verdict = orbit_verdict(with_summary(fit_result, converged=False, reason="it ran out"))
    assert verdict.state == "bad"
    assert "not be trusted" in verdict.headline
    assert verdict.reasons[0] == "The fit has not converged: it ran out."


def test_chi2_far_off_is_reported(fit_result):
    verdict = orbit_verdict(with_summary(fit_result, chi2_per_dof=2.0))
    assert verdict.state == "bad"
    assert any("2.000, far from the expected value" in sentence for sentence in verdict.reasons)


def test_exposure_and_source_that_stand_out_are_named(fit_result):
    exposures, sources = fit_result.exposures.copy(), fit_result.sources.copy()
    exposures.loc[3, "chi2"] *= 2.0
    sources.loc[5, "chi2"] = sources.loc[5, "dof"] * 9.0
    notable = orbit_verdict(replace(fit_result, exposures=exposures, sources=sources)).notable
    plate = exposures.loc[3, ["field_id", "plate_id"]].astype(int).tolist()
    assert any("field {}, exposure {}".format(*plate) in sentence for sentence in notable)
    assert any(str(sources.loc[5, "source_id"]) in sentence for sentence in notable)


def test_sources_within_chance_are_not_reported(fit_result):
    """The chi2 of few measurements is skewed, so that chance alone gives large values."""
    dof = np.full(len(fit_result.sources), 8.0)
    quantiles = (np.arange(len(dof)) + 0.5) / len(dof)
    by_chance = fit_result.sources.assign(dof=dof, chi2=chdtri(dof, 1.0 - quantiles))
    notable = orbit_verdict(replace(fit_result, sources=by_chance)).notable
    assert not any(sentence.startswith("Sources that scatter") for sentence in notable)


@pytest.mark.parametrize(("chi2", "state"), [(100.0, "good"), (170.0, "bad"), (50.0, "warn")])
def test_source_is_judged_by_its_scatter_about_the_motion(survey, chi2, state):
    history, motion = survey.source("other")
    motion = motion.copy()
    motion["chi2"], motion["dof"] = chi2, 100
    assert source_verdict(history, motion).state == state


def test_source_without_a_motion_cannot_be_judged(survey):
    history, _ = survey.source("other")
    assert source_verdict(history, None).state == "warn"


def test_table_of_the_tests_counts_those_that_are_cut_off(monkeypatch, fit_result):
    judged = orbit_verdict(fit_result)
    found = [one._replace(is_found=True) for one in judged.tests]
    monkeypatch.setitem(fit_result.derived, "verdict", judged._replace(tests=found))
    table = solution_tests(fit_result, most=5)
    assert len(table) == 5
    assert (table[["total", "total_found"]] == len(found)).all(axis=None)
    subtitle = plot_solution_tests(table).frames[0].subtitle
    assert subtitle.startswith(f"{len(found)} of {len(found)} find more than chance; the first 5 ")


@pytest.mark.parametrize(
    "largest", [[], [3.6], [9.0, 3.5, 3.3], [20.0, 9.0, 3.5, 3.2, 3.1]], ids=len
)
def test_limit_lies_between_the_tests_that_are_found_and_all_others(
    fit_result, monkeypatch, largest
):
    judged = orbit_verdict(fit_result)
    far = np.array([*largest, *np.ones(len(judged.tests) - len(largest))])
    found = discoveries(np.array([log_chance_normal(one) for one in far]), CARE_RATE)
    tests = [
        one._replace(sigma=sigma, is_found=is_found)
        for one, sigma, is_found in zip(judged.tests, far.tolist(), found.tolist(), strict=True)
    ]
    monkeypatch.setitem(fit_result.derived, "verdict", judged._replace(tests=tests))
    table = solution_tests(fit_result)
    assert ((table["sigma"] > table["limit"]) == table["is_found"]).all()
