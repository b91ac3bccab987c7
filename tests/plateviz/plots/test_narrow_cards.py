"""Figures in a window 1366 pixels wide keep the numbers above their frames."""

import pytest

from plateviz.figures.resized import resized
from plateviz.plots.gallery import diagnostics, survey_figures


@pytest.mark.parametrize(
    ("name", "drawing", "width"),
    [("deviation", "deviation", 535), ("orbit-health", "orbit_health", 1078)],
)
def test_numbers_have_room_in_a_narrow_window(name, drawing, width, drawings):
    (card,) = [one for one in (*diagnostics(), *survey_figures()) if one.name == name]
    draw, table = drawings[drawing]
    # The insets of a card, and its border.
    figure = resized(draw(table), width - 8, card.narrow_height - 10, corner=76)
    assert all(frame.subtitle for frame in figure)
