"""Cards of figures: how high they are at least."""

import re

import pytest

from plateviz.dashboard.views.cards.figure import FigureView
from plateviz.plots.gallery import diagnostics, survey_figures


@pytest.mark.parametrize(
    ("name", "heights"),
    [("residual-map", (290, 290, 290)), ("eigenmode-groups", (450, 450, 450))],
)
def test_card_is_as_high_as_its_figure_needs(name, heights):
    (figure,) = [one for one in diagnostics() if one.name == name]
    assert least_heights(figure) == heights


def test_card_of_many_frames_is_higher_in_a_narrow_window():
    (figure,) = [one for one in survey_figures() if one.name == "calibration-trends"]
    heights = figure.least_height, figure.narrow_height, figure.column_height
    assert least_heights(figure) == heights
    assert heights[0] < heights[1] < heights[2]


def least_heights(figure):
    """Return the least heights of a figure's card: in a large, a narrow and a narrower window."""
    sheets = "".join(FigureView(figure, lambda: None).__panel__().stylesheets)
    return tuple(int(height) for height in re.findall(r"min-height: (\d+)px", sheets))
