"""Settings as words: what is written is read back equal, and what is invalid is named."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.data.engine_settings import engine_settings
from solver.data.setting_words import parse_setting_words, setting_words
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.errors import InputError

SETTINGS = [
    FitSettings(),
    FitSettings(order=7, aberration=False, robust=True, thin=3, compare_orders=True),
    FitSettings(prior_widths={"distortion_x": 1 / 3, "position_angle": float("inf")}),
    FitSettings(prior_shifts={"focal_length": 100.0, "detector_x[2]": -5.25, "sources[ra]": 0.1}),
    FitSettings(
        exclusions=Subset(frozenset({-(2**63) + 1, 12}), frozenset({(0, 3)}), frozenset({1}))
    ),
    FitSettings(engine="svi", **engine_settings(seed=2, steps=30)),
    FitSettings(engine="svi", **engine_settings(steps=2000, compat="warpfield")),
    FitSettings(engine="nuts", **engine_settings(seed=4)),
    FitSettings(engine="svi", **engine_settings(seed=2**32 - 1)),
]


@pytest.mark.parametrize("settings", SETTINGS)
def test_words_are_read_back_equal_and_have_no_spaces(settings):
    words = setting_words(settings)
    assert parse_setting_words(" ".join(words).split()) == settings


def test_words_are_those_of_the_command_line_and_have_what_differs():
    assert setting_words(FitSettings()) == ["order=5"]
    changed = FitSettings(
        order=3,
        aberration=False,
        prior_widths={"distortion_x": 0.5},
        exclusions=Subset(detectors=frozenset({1})),
    )
    assert setting_words(changed) == [
        "order=3",
        "no-aberration",
        "prior=distortion_x=0.5um",
        "exclude=detector=1",
    ]


@given(st.floats(1e-9, 1e9))
def test_every_digit_of_a_width_is_kept(width):
    settings = FitSettings(prior_widths={"detector_x": width})
    (read,) = parse_setting_words(setting_words(settings)).prior_widths.values()
    assert np.float64(read) == np.float64(width)


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("", "expected settings of a fit such as order=3, found ''"),
        ("spline", "found 'spline'"),
        ("no-order", "found 'no-order'"),
        ("order", "order: expected a whole number, found ''"),
        ("order=5.0", "order: expected a whole number, found '5.0'"),
        ("order=" + "9" * 5000, "order: expected a whole number"),
        ("robust=yes", "robust: expected True or False, found 'yes'"),
        ("engine=magic", "gauss-newton.*'magic'"),
        ("prior=distortion_x", "--prior: expected GROUP=VALUE"),
        ("prior=nothing=1um", "expected a parameter group"),
        ("centre=detector_x[2]", "centre of a prior"),
        ("exclude=source=" + "9" * 5000, "expected source=ID"),
        ("exclude=source=9999999999999999999", "an id of 64 bits"),
        ("seed=-1", "seed"),
        ("steps=0", "svi steps"),
        ("compat=other", "expected warpfield"),
        ("thin=0", "thin"),
    ],
)
def test_invalid_word_is_named(word, told):
    with pytest.raises(InputError, match=told):
        parse_setting_words([word])


@given(st.lists(st.text(max_size=30), max_size=4))
def test_nonsense_is_refused_or_read(words):
    try:
        settings = parse_setting_words(words)
    except InputError:
        return
    assert isinstance(settings, FitSettings)


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (("prior=distortion_x=1um", "prior=distortion_x=2um"), "one width for distortion_x"),
        (("centre=pitch_x=1um", "centre=pitch_x=2um"), "one shift for pitch_x"),
    ],
)
def test_group_has_one_prior(words, found):
    with pytest.raises(InputError, match=f"expected {found}, found two"):
        parse_setting_words(words)
