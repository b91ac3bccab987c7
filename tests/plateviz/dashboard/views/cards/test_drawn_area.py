"""What an area drawn in a figure of points selects, with messages as the browser sends them."""

import pytest
from bokeh.events import PanStart, SelectionGeometry

from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.cards.figure import FigureView
from plateviz.dashboard.views.cards.point_actions import session_actions
from plateviz.plots.gallery import diagnostics
from solver.data.subset import Subset
from tests.plateviz.dashboard.fake_store import FakeStore
from tests.plateviz.dashboard.views.cards.test_figure import come_near, figure_of, plot

EMPTY = {"type": "rect", "x0": 5.0, "x1": 6.0, "y0": 0.0, "y1": 2.0}
LASSO = {"type": "poly", "x": [5.0, 6.0, 5.5], "y": [0.0, 0.0, 2.0]}
FIRST_TWO = {"type": "rect", "x0": -1.0, "x1": 1.5, "y0": 0.0, "y1": 2.0}
BEFORE = Subset(frozenset({7, 8}), frozenset({(0, 3)}))


class Page:
    """A figure of three sources, and the session whose selection it shows."""

    def __init__(self, fit_result):
        self.session = Session(FakeStore(fit_result))
        actions = session_actions(self.session)
        self.view = FigureView(
            diagnostics()[0], lambda: figure_of(["7", "8", "9"]), actions=actions
        )
        come_near(self.view)
        self.show()
        self.plot = plot(self.view)
        self.rows = self.plot.renderers[0].data_source.selected

    @property
    def selection(self):
        return self.session.selection

    def select(self, selected):
        self.selection.select(selected)
        self.show()

    def show(self):
        self.view.show_selected(self.selection.ids)
        self.view.draw()

    def drag(self, rows, geometry, shows_between=False):
        self.plot._trigger_event(PanStart(self.plot))
        self.rows.indices = rows
        if shows_between:
            self.show()
        self.plot._trigger_event(SelectionGeometry(self.plot, geometry=geometry, final=True))


@pytest.fixture
def page(fit_result):
    return Page(fit_result)


@pytest.mark.parametrize("geometry", [EMPTY, LASSO], ids=["box", "lasso"])
@pytest.mark.parametrize("shows_between", [False, True])
def test_area_around_nothing_leaves_the_selection(page, geometry, shows_between):
    page.select(BEFORE)
    page.drag([], geometry, shows_between)
    assert page.selection.selected == BEFORE
    assert page.session.remark.endswith("what was selected stays selected")
    page.show()
    assert page.rows.indices == [0, 1]


def test_area_around_nothing_says_so_where_nothing_is_selected(page):
    page.drag([], EMPTY)
    assert page.session.remark.endswith("nothing is selected")
    page.drag([2], {**EMPTY, "x0": 1.5})
    assert (page.session.remark, page.selection.sources) == ("", frozenset({9}))


def test_area_deselects_the_points_in_it(page):
    page.select(BEFORE)
    # With Shift and Ctrl.
    page.drag([], FIRST_TWO)
    assert page.selection.selected == Subset(exposures=BEFORE.exposures)
    assert page.session.remark == ""


def test_tap_beside_the_points_and_escape_select_nothing(page):
    for events in ([{"type": "point", "x": 5.0, "y": 1.0}], []):
        page.select(BEFORE)
        page.rows.indices, page.session.remark = [], ""
        for geometry in events:
            page.plot._trigger_event(SelectionGeometry(page.plot, geometry=geometry, final=True))
        assert page.selection.selected == Subset(exposures=BEFORE.exposures)
        assert page.session.remark == ""
        # What was cleared before somebody draws does not come back.
        page.show()
        page.drag([], EMPTY)
        assert page.selection.selected == Subset(exposures=BEFORE.exposures)
