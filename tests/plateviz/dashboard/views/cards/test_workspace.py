"""A workspace: its cards have the row that fills the window, and their grid has no hole."""

import panel as pn
import pytest

from plateviz.dashboard.views.cards.figure import FigureView
from plateviz.dashboard.views.cards.figure_grid import FigureGrid
from plateviz.dashboard.views.cards.workspace import below_lines, workspace
from plateviz.plots.gallery import diagnostics
from tests.plateviz.dashboard.card_places import takes_row


@pytest.fixture
def view():
    return FigureView(diagnostics()[0], lambda: None)


def test_parts_of_a_workspace_stand_above_and_below_its_cards(view):
    grid, first, last = FigureGrid([view], lambda *_: None), pn.Spacer(), pn.Spacer()
    box = workspace(grid, first, below=[last])
    head, middle, foot = box
    assert list(head) == [first]
    assert foot is last
    assert middle is grid.__panel__() or grid.__panel__() in list(middle)
    assert box.sx["gridTemplateRows"] == "auto minmax(0, 1fr) auto"


def test_workspace_is_lower_below_other_lines_of_its_page(view):
    height = workspace(FigureGrid([view], lambda *_: None)).sx["minHeight"]
    (name,) = below_lines(1)
    assert f"- var({name}, 0px)" in height
    assert below_lines(0) == {name: "0px"}
    assert below_lines(1) != below_lines(0)


def test_hidden_parts_leave_the_cards_the_row_that_fills_the_window(view):
    """The browser gives the parts that are not hidden the rows in order."""
    first, hidden = pn.Spacer(), pn.Spacer(visible=False)
    box = workspace(FigureGrid([view], lambda *_: None), hidden, first)
    assert [part.visible for part in box] == [True, True]
    assert box.sx["gridTemplateRows"] == "auto minmax(0, 1fr)"


def test_first_wide_card_takes_a_row_of_a_grid_that_would_have_a_hole():
    named = {one.name: one for one in diagnostics()}
    wide, second, third = (
        FigureView(named[name], lambda: None)
        for name in ("mean-residual-map", "solution-tests", "residual-map")
    )
    FigureGrid([second, wide], lambda *_: None)
    assert not takes_row(wide)
    FigureGrid([second, wide, third], lambda *_: None)
    assert takes_row(wide)
    assert not takes_row(second)


def test_three_cards_stand_above_two_wide_ones_on_a_large_screen():
    named = {one.name: one for one in diagnostics()}
    names = ("residual-map", "residual-scatter", "pulls", "residual-tails", "largest-residuals")
    views = [FigureView(named[name], lambda: None) for name in names]
    grid = FigureGrid(views, lambda *_: None)
    assert "repeat(6" in str(grid.__panel__().sx)
    spans = ["span 3" if view.is_wide else "span 2" for view in views]
    assert spans == 3 * ["span 2"] + 2 * ["span 3"]
    for view, span in zip(views, spans, strict=True):
        assert f"grid-column: {span}" in view.__panel__().stylesheets[-1]
