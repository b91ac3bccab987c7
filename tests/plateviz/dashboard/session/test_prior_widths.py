"""Prior widths in their controls: short, and no digit is lost."""

import pytest

from plateviz.dashboard.session.fit_choices import FitChoices
from plateviz.dashboard.session.prior_widths import default_widths, width_texts, widths_of
from solver.data.parameters import BY_NAME
from solver.data.settings import FitSettings

THIRD = FitSettings(prior_widths={"distortion_x": 1.0 / 3.0})


def test_texts_have_six_digits():
    assert default_widths()["focal_length"] == "5729.58 um"
    assert width_texts(THIRD)["distortion_x"] == "0.333333 um"
    assert max(map(len, default_widths().values())) < 16


@pytest.mark.parametrize("settings", [FitSettings(), THIRD])
def test_what_is_not_changed_is_not_lost(settings):
    choices = FitChoices()
    choices.load(settings)
    assert choices.settings() == settings
    choices.prior_widths = {**choices.prior_widths, "detector_x": "2 um"}
    assert choices.settings().prior_widths == {**settings.prior_widths, "detector_x": 2.0}


def test_typed_width_is_what_it_says():
    texts = {**width_texts(THIRD), "distortion_x": "0.333333 mm"}
    assert widths_of(texts, THIRD) == {"distortion_x": pytest.approx(333.333, rel=1e-12)}


def test_paper_s_width_comes_back_whole():
    width = BY_NAME["focal_length"].width
    near = FitSettings(prior_widths={"focal_length": width * (1.0 + 1e-9)})
    # Six digits would not tell it from the paper's.
    assert width_texts(near)["focal_length"] != default_widths()["focal_length"]
    assert widths_of(width_texts(near), near) == near.prior_widths
    assert widths_of(default_widths(), near) == {}
