"""Settings of a fit as keywords: values as on the command line, and one message for mistakes."""

import inspect
import math

import astropy.units as u
import pytest

from plateviz.notebook.keywords import KEYWORDS, settings_with, takes_settings
from solver.data.settings import FitSettings
from solver.errors import InputError

PAPER = FitSettings()


def test_no_keyword_leaves_the_settings_unchanged():
    assert settings_with(PAPER, {}) == PAPER


@pytest.mark.parametrize(
    ("width", "expected"),
    [
        pytest.param("10um", 10.0, id="text"),
        pytest.param(2.5, 2.5, id="number"),
        pytest.param(3.0 * u.um, 3.0, id="quantity"),
        pytest.param("flat", math.inf, id="flat"),
        pytest.param(math.inf, math.inf, id="infinite"),
    ],
)
def test_prior_width_is_a_text_a_number_or_a_quantity(width, expected):
    settings = settings_with(PAPER, {"priors": {"distortion_x": width}})
    assert settings.prior_widths == {"distortion_x": expected}


def test_centre_is_shifted_for_a_group_or_an_element():
    centres = {"focal_length": "100um", "detector_x[2]": -5}
    assert settings_with(PAPER, {"centres": centres}).prior_shifts == {
        "focal_length": 100.0,
        "detector_x[2]": -5.0,
    }


@pytest.mark.parametrize("exclude", ["detector=2", ["detector=2"]], ids=["text", "list"])
def test_exclusion_is_written_as_on_the_command_line(exclude):
    assert settings_with(PAPER, {"exclude": exclude}).exclusions.detectors == {2}


def test_priors_change_by_name_and_other_settings_stay():
    base = settings_with(PAPER, {"order": 3, "priors": {"pitch_x": 1.0, "pitch_y": 2.0}})
    settings = settings_with(base, {"priors": {"pitch_y": 4.0}})
    assert settings.order == 3
    assert settings.prior_widths == {"pitch_x": 1.0, "pitch_y": 4.0}


def test_steps_and_seed_are_settings_of_the_engines():
    settings = settings_with(PAPER, {"engine": "svi", "steps": 30, "seed": 5})
    assert (settings.svi.steps, settings.svi.seed, settings.nuts.seed) == (30, 5, 5)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ordre": 3}, "found 'ordre'; did you mean order"),
        ({"order": 12}, "order from 0 to 9, found 12"),
        ({"order": "5"}, "order from 0 to 9, found '5'"),
        ({"engine": "magic"}, "engine out of gauss-newton"),
        ({"robust": "no"}, "robust: expected True or False, found 'no'"),
        ({"thin": 0}, "thin to be 1 or more"),
        ({"priors": ["distortion_x"]}, r"priors: expected names and values .* \['distortion_x'\]"),
        ({"priors": {"distortion": "1um"}}, "parameter group out of .* found 'distortion'"),
        ({"priors": {"distortion_x": "1 kg"}}, "prior of distortion_x: .* found 'kg'"),
        ({"priors": {"distortion_x": -1}}, "positive prior width"),
        ({"centres": {"detector_x[2]": "far"}}, "centre of a prior: expected .*found"),
        ({"exclude": "detector 2"}, "what to leave out: expected source=ID"),
        ({"exclude": 2}, "exclude: expected texts such as 'detector=2', found 2"),
        ({"steps": 2.5}, "svi steps to be 1 or more, found 2.5"),
        ({"seed": -1}, "seed from 0 to 4294967295"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_invalid_keyword_or_value_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        settings_with(PAPER, changes)


def test_signature_has_the_keywords():
    @takes_settings
    def fit(orbit, **settings):
        return settings

    names = list(inspect.signature(fit).parameters)
    assert names == ["orbit", *KEYWORDS]
    assert fit(1, order=3) == {"order": 3}
