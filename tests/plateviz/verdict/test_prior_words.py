from types import SimpleNamespace

import pytest

from plateviz.verdict.cause_words import said_of
from plateviz.verdict.prior_words import narrowed_priors
from plateviz.verdict.remedy import remedied
from solver.data.parameters import BY_NAME, PARAMETERS
from solver.data.settings import FitSettings
from solver.results.diagnosis.test import Test


def said_with(name="distortion_x", **settings):
    """Return what is said where the values of a group lie 8 widths from the centre of its prior."""
    place = PARAMETERS.index(BY_NAME[name])
    test = Test(f"values of {name} against their prior", "prior", (place,), 8.0, 1.0, 0.6, -30.0, 7)
    result = SimpleNamespace(settings=FitSettings(**settings))
    return said_of(SimpleNamespace(found=SimpleNamespace(test=test), result=result))


def test_narrow_prior_is_to_be_as_wide_as_usual():
    narrow = {"distortion_x": 0.03}
    said = said_with(prior_widths=narrow)
    assert said.title == "the prior of distortion_x contradicts the measurements"
    assert "8 times as far from its centre" in said.words
    assert "0.03 um." in said.words
    wider = remedied(FitSettings(prior_widths=narrow), said.options)
    assert wider.width("distortion_x") == BY_NAME["distortion_x"].width


@pytest.mark.parametrize("name", ["distortion_y", "focal_length", "pitch_x", "detector_rotation"])
def test_usual_prior_is_to_be_wide_enough_for_the_values(name):
    said = said_with(name)
    wider = remedied(FitSettings(), said.options)
    assert wider.width(name) == pytest.approx(16.0 * BY_NAME[name].width, rel=0.3)


def test_value_that_no_instrument_has_points_to_wrong_units():
    place = PARAMETERS.index(BY_NAME["pitch_x"])
    actions = []
    for rms in (8.0, 90.0):
        test = Test("values against their prior", "prior", (place,), rms, 1.0, 0.6, -30.0, 7)
        result = SimpleNamespace(settings=FitSettings())
        actions.append(said_of(SimpleNamespace(found=SimpleNamespace(test=test), result=result)))
    assert [one.action.startswith("check the instrument") for one in actions] == [False, True]
    assert all(one.action.endswith("widen it") for one in actions)


def test_shifted_prior_is_to_be_where_it_was():
    said = said_with("detector_x", prior_shifts={"detector_x[2]": 50.0})
    assert "shifted" in said.words
    assert said.action == "take back the shift of its centre"
    assert not said.options


def test_wide_prior_is_not_narrowed():
    widths = {"distortion_x": 0.5, "distortion_y": 3.0, "sources": 0.5}
    assert narrowed_priors(FitSettings(prior_widths=widths)) == ["distortion_x", "sources"]
