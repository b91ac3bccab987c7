from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from plateviz.verdict.cause_words import said_of
from solver.data.settings import FitSettings
from solver.results.diagnosis.test import Test


@pytest.mark.parametrize(("step", "field"), [(0, 7), (1, 2)])
def test_step_is_at_the_field_that_comes_first_in_time(step, field):
    # In time, the fields are 5, 7 and 2.
    exposures = pd.DataFrame({"field_id": [2, 5, 7], "obstime": [61_803.0, 61_801.0, 61_802.0]})
    number = np.array([2, 0, 1])
    patterns = SimpleNamespace(times=(number >= [[1], [2]]) - 0.5, n_steps=2)
    test = Test("distortion between fields", "step", (2, step), 50.0, 6.0, 3.0, -20.0, 5.0, 0.1)
    case = SimpleNamespace(
        found=SimpleNamespace(test=test),
        diagnosis=SimpleNamespace(patterns=patterns),
        result=SimpleNamespace(exposures=exposures),
    )
    said = said_of(case)
    assert said.title == f"the distortion changes at field {field}"
    assert said.words == (
        "The terms of the second degree are not the same before and after: 100 nm rms on the focal "
        "plane; χ², scaled to the scatter that is left, would fall by 50 with 6 parameters more."
    )
    assert said.options == ("--field-distortion 2",)


@pytest.mark.parametrize(
    ("factor", "asks_for_units"), [(0.05, True), (0.8, False), (1.3, False), (10.0, True)]
)
def test_noise_that_no_instrument_has_is_a_question_of_units(factor, asks_for_units):
    said = said_of_noise(factor, 0.1)
    assert said.action.startswith("check the units of sx and sy") == asks_for_units
    assert f"multiply sx and sy by {factor:.3f}" in said.action or asks_for_units
    assert said.options == ("--noise-scale",)


@pytest.mark.parametrize(
    ("factor", "kurtosis", "are_many"),
    [(5.4, 5.2, True), (5.4, 0.1, False), (1.3, 5.2, False), (0.1, 5.2, False)],
)
def test_many_outliers_cannot_be_told_from_noise(factor, kurtosis, are_many):
    said = said_of_noise(factor, kurtosis)
    assert ("or many measurements are outliers" in said.title) == are_many
    assert ("--robust" in said.options) == are_many
    assert said.options[-1] == "--noise-scale"


def said_of_noise(factor, kurtosis):
    """Return what is said of noise of this size, whose residuals have tails."""
    test = Test("noise", "noise", (), factor**2, 1.0, 0.01, -400.0, 30.0)
    tails = Test("kurtosis", "kurtosis", (), kurtosis, 0.0, 0.01, -400.0, 30.0)
    diagnosis = SimpleNamespace(tests=(test, tails))
    return said_of(SimpleNamespace(found=SimpleNamespace(test=test), diagnosis=diagnosis))


@pytest.mark.parametrize(
    ("days", "begin"),
    [
        (60.0, "the stars are measured 60 days later than"),
        (-60.0, "the stars are measured 60 days earlier than"),
        (4.7e6, "the stars have not moved as their proper motions say"),
        (-4.7e6, "the stars have not moved as their proper motions say"),
    ],
)
def test_time_that_no_catalogue_is_off_by_is_a_question_of_units(days, begin):
    said = said_of_stars("epoch", days)
    assert said.title.startswith(begin)
    assert ("unit of the proper motions" in said.action) == (abs(days) > 1e5)


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize(("kurtosis", "title"), [(0.3, "more large errors"), (-0.3, "fewer large")])
def test_noise_that_is_not_normal_has_more_or_fewer_large_errors(kurtosis, title, robust):
    test = Test("kurtosis", "kurtosis", (), kurtosis, 0.0, 0.01, -400.0, 30.0)
    result = SimpleNamespace(settings=FitSettings(robust=robust))
    said = said_of(SimpleNamespace(found=SimpleNamespace(test=test), result=result))
    assert title in said.title
    assert f"is {kurtosis:+.3f}" in said.words
    # Small outliers, which a robust fit keeps, make large errors and no small ones.
    assert ("outliers" in said.words) == (robust and kurtosis > 0.0)
    assert not said.options


@pytest.mark.parametrize(("robust", "options"), [(False, ("--robust",)), (True, ())])
def test_large_tails_are_left_out_where_they_are_not(robust, options):
    test = Test("kurtosis", "kurtosis", (), 5.2, 0.0, 0.02, -400.0, 30.0)
    result = SimpleNamespace(settings=FitSettings(robust=robust))
    said = said_of(SimpleNamespace(found=SimpleNamespace(test=test), result=result))
    assert said.options == options


def said_of_stars(subject, size, items=(), statistic=9.0, **settings):
    """Return what is said of stars that are not where the catalogue has them."""
    test = Test("stars", subject, (), statistic, 1.0, 0.1, -400.0, 30.0)
    found = SimpleNamespace(test=test, size=size, items=items)
    result = SimpleNamespace(settings=FitSettings(**settings))
    return said_of(SimpleNamespace(found=found, result=result))


@pytest.mark.parametrize(
    ("size", "settings", "options"),
    [
        (3.0, {}, ("--reference-scale",)),
        (3.0, {"reference_scale": True}, ("--prior sources=3.00",)),
        (53.0, {}, ()),
        (53.0, {"reference_scale": True}, ()),
        (5.0, {"reference_scale": True, "prior_widths": {"sources": 12.0}}, ()),
    ],
    ids=["some", "scaled", "many", "many, scaled", "many, widened"],
)
def test_no_option_makes_a_catalogue_right_that_is_far_off(size, settings, options):
    said = said_of_stars("references", size, **settings)
    assert said.options == options
    assert said.name == ("reference-errors" if options else "wrong-catalogue")
    assert ("check the proper motions" in said.action) == (not options)


def test_reference_stars_that_are_too_near_the_catalogue_are_not_said_to_be_far():
    said = said_of_stars("references", 1.0, statistic=0.12)
    assert said.title == "the reference stars are nearer the catalogue than it states"
    assert "rms deviation is 0.12 of its errors, where 1 is expected" in said.words
    assert said.options == ("--reference-scale",)


@pytest.mark.parametrize(("count", "has_options"), [(1, True), (20, True), (21, False)])
def test_few_stars_are_to_be_left_out_and_many_corrected(count, has_options):
    said = said_of_stars("other", float(count), tuple(range(1, count + 1)))
    assert said.title.startswith("1 star is not" if count == 1 else f"{count} stars are not")
    assert len(said.options) == (count if has_options else 0)
    assert ("out" in said.action) == has_options
    assert ("..." in said.words) == (count > 8)


def test_catalogue_that_states_too_small_errors_is_to_be_checked():
    said = said_of_stars("others", 18.2)
    assert said.words == "Its errors are about 18.2 times those stated."
    assert "check the units and epochs" in said.action
