"""Figures in narrow windows keep the numbers above their frames, their height and legends."""

from dataclasses import replace

import pytest

from plateviz.figures.resized import resized
from plateviz.plots.gallery import diagnostics, source_figures, survey_figures


@pytest.mark.parametrize(
    ("name", "drawing", "width"),
    [("deviation", "deviation", 535), ("orbit-health", "orbit_health", 1078)],
)
def test_numbers_have_room_in_a_narrow_window(name, drawing, width, drawings):
    card, (draw, table) = card_of(name), drawings[drawing]
    # The insets of a card, and its border.
    figure = resized(draw(table), width - 8, card.narrow_height - 10, corner=76)
    assert all(frame.subtitle for frame in figure)


# Of the trends, the calibration of a satellite with several detectors has eight frames.
@pytest.mark.parametrize(
    ("name", "copies"),
    [
        ("binned-residuals", 1),
        ("calibration-trends", 8),
        ("motion-pulls", 1),
        ("orbit-health", 1),
        ("reference-scatter", 1),
        ("time-series", 1),
    ],
)
def test_frames_in_one_column_are_high_enough_and_have_their_legend(name, copies, drawings):
    card, (draw, table) = card_of(name), drawings[name.replace("-", "_")]
    figure = draw(table)
    figure = replace(figure, frames=figure.frames * copies)
    # A card in a window 768 pixels wide.
    figure = resized(figure, 480 - 8, card.column_height - 10, corner=76)
    assert min(frame.frame_height for frame in figure) >= 100
    assert any(frame.legend_columns for frame in figure)


@pytest.mark.parametrize(("name", "copies"), [("binned-residuals", 1), ("calibration-trends", 8)])
def test_frames_on_a_laptop_have_their_legend(name, copies, drawings):
    card, (draw, table) = card_of(name), drawings[name.replace("-", "_")]
    figure = draw(table)
    figure = replace(figure, frames=figure.frames * copies)
    # A card as wide as the page, in a window 1366 pixels wide.
    figure = resized(figure, 1078 - 8, card.narrow_height - 10, corner=76)
    assert any(frame.legend_columns for frame in figure)


def card_of(name):
    cards = (*diagnostics(), *survey_figures(), *source_figures())
    return next(one for one in cards if one.name == name)
