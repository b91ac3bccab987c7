"""The summary strip: states by the expected scatter, and hints that state the rule."""

import dataclasses

import pytest

from plateviz.tables import summary_strip
from plateviz.tables.summary import LEAST_OBS
from solver.results.summary import MIN_OBS

KINDS = ("mean", "rms", "pull_rms", "pull_sd", "induced")


def _with(result, **changes):
    return dataclasses.replace(result, summary={**result.summary, **changes})


def _item(result, label):
    return next(item for item in summary_strip(result) if item.label == label)


@pytest.mark.parametrize(
    ("value", "state"),
    [(1.0, "good"), (1.0059, "good"), (1.0061, "warn"), (0.9, "warn"), (1.3, "bad"), (0.7, "bad")],
    ids=["on it", "2.95 sigma", "3.05 sigma", "10 % low", "30 % high", "30 % low"],
)
def test_chi2_is_judged_by_its_expected_scatter(fit_result, value, state):
    result = _with(fit_result, chi2_per_dof=value, dof=500_000.0)
    assert _item(result, "χ² per degree of freedom").state == state


def test_hint_states_the_expected_scatter(fit_result):
    hint = _item(_with(fit_result, dof=20_000.0), "χ² per degree of freedom").hint
    assert "1.000 ± 0.010" in hint
    assert "√(2/dof)" in hint


@pytest.mark.parametrize(
    ("value", "state"),
    [(0.33, "good"), (0.42, "good"), (0.45, "bad"), (1.0, "bad")],
    ids=["expected", "within", "beyond", "unity is not expected"],
)
def test_normalised_deviation_is_judged_beside_its_expected_value(fit_result, value, state):
    result = _with(
        fit_result,
        n_reference=50,
        normalised_deviation_ra=value,
        expected_normalised_deviation_ra=0.33,
    )
    item = _item(result, "Reference sources, α")
    assert item.state == state
    assert "expected 0.330" in item.value


def test_no_reference_source_is_bad_and_does_not_divide_by_zero(fit_result):
    nothing = float("nan")
    result = _with(
        fit_result,
        n_reference=0,
        normalised_deviation_ra=nothing,
        expected_normalised_deviation_ra=nothing,
    )
    assert _item(result, "Reference sources").state == "bad"
    assert _item(result, "Reference sources, α").state == "neutral"


def test_fit_that_did_not_converge_is_bad_and_gives_the_reason(fit_result):
    item = _item(_with(fit_result, converged=False, reason="no damping helped"), "Converged")
    assert (item.value, item.state, item.hint) == ("no", "bad", "no damping helped")


def test_pulls_against_the_truth_appear_only_with_a_truth(fit_result):
    assert not any("truth" in item.label for item in summary_strip(fit_result))
    figures = {"n": 12, **{f"{kind}_{axis}": 0.5 for kind in KINDS for axis in ("ra", "dec")}}
    with_truth = _with(fit_result, truth={"artificial": figures})
    item = _item(with_truth, f"Pulls against truth, artificial, N ≥ {MIN_OBS}")
    assert item.value == "0.50, 0.50 (0.50 mas rms)"
    assert "12 sources" in item.hint


def test_pulls_are_said_to_be_of_the_sources_that_the_solver_takes():
    assert LEAST_OBS == MIN_OBS


def test_counts_and_time_are_formatted(fit_result):
    assert _item(fit_result, "Measurements").value == f"{len(fit_result.residuals):,}"
    assert _item(fit_result, "Time").value == "2.2 s"
    assert "fit 1.60 s" in _item(fit_result, "Time").hint
