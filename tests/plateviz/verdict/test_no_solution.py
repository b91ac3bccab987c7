"""The verdict on a fit that ended without uncertainties."""

import json
import pickle

import pytest

from plateviz.verdict.causes import Cause
from plateviz.verdict.no_solution import no_solution_summary, no_solution_verdict
from plateviz.verdict.verdict import Verdict
from solver.data.setting_words import setting_values
from solver.data.settings import FitSettings
from solver.errors import LikelyCause, NoSolutionError

SUMMARY = {"converged": False, "reason": "a direction is open", "n_measurements": 500}


def failed(name="open-direction", chi2=3e4, is_misfit=False):
    cause = LikelyCause(name, "the priors are too wide", "58 stars", "narrow a prior", is_misfit)
    return NoSolutionError(f"orbit 7: {cause.sentence()}", SUMMARY, chi2, cause)


def test_summary_has_what_is_known_and_all_of_a_verdict():
    found = no_solution_summary(failed(), FitSettings())
    assert {name: found[name] for name in SUMMARY} == SUMMARY
    verdict = found["verdict"]
    assert set(verdict) == set(Verdict._fields)
    assert (verdict["state"], verdict["tests"]) == ("bad", [])
    assert verdict["headline"] == "This orbit has no solution: the priors are too wide."
    (cause,) = verdict["causes"]
    assert set(cause) == set(Cause._fields)
    assert (cause["words"], cause["action"]) == ("58 stars.", "narrow a prior")
    assert verdict["reasons"][0] == "The fit has not converged: a direction is open."
    assert "What to do: narrow a prior." in verdict["reasons"][1]


@pytest.mark.parametrize("chi2", [0.0, 3e4, float("inf"), float("nan")], ids=str)
@pytest.mark.parametrize("is_misfit", [True, False], ids=["misfit", "no misfit"])
def test_no_number_of_it_is_missing_in_json(chi2, is_misfit):
    found = no_solution_summary(failed(chi2=chi2, is_misfit=is_misfit), FitSettings())
    assert json.dumps(found, allow_nan=False)


def test_significance_is_that_of_the_residuals_where_they_are_the_evidence():
    far, open_direction = (
        no_solution_verdict(failed(is_misfit=is_misfit), FitSettings()).causes[0]
        for is_misfit in (True, False)
    )
    assert far.significance > 100.0
    assert open_direction.significance == 0.0


def test_widened_priors_are_named_with_the_options_that_take_them_back():
    settings = FitSettings().with_(prior_widths={"pitch_x": float("inf"), "pitch_y": 1e-3})
    (cause,) = no_solution_verdict(failed(), settings).causes
    assert "wider than usual: pitch_x." in cause.words
    assert setting_values([one.removeprefix("--").replace(" ", "=", 1) for one in cause.options])
    assert cause.options == ("--prior pitch_x=0.01",)
    (other,) = no_solution_verdict(failed("wrong-estimates"), settings).causes
    assert not other.options


def test_error_survives_another_process():
    error = failed()
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "orbit 7: 58 stars: narrow a prior."
    assert (again.summary, again.chi2, again.cause) == (error.summary, error.chi2, error.cause)
