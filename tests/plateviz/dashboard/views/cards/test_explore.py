"""ExploreView over a run: drawn when it is read, areas select, and failures are said in place."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from bokeh.events import RangesUpdate, SelectionGeometry

from plateviz.dashboard.navigation import rows_to_explore
from plateviz.dashboard.navigation.lost_run import look_for_run
from plateviz.dashboard.navigation.navigation import Navigation, View
from plateviz.dashboard.navigation.rows_to_explore import OrbitRows, RunRows
from plateviz.dashboard.saving import explored_file
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.cards import explore
from plateviz.dashboard.views.cards.explore import ExploreView
from plateviz.plots.elements.style import ROW_LIMIT
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.runs.column_cache import ColumnCache
from plateviz.runs.explorable import COLUMNS_OF_RUN
from plateviz.tables.explore import ExplorableTable, explorable
from solver.data.schema import RESIDUALS
from solver.data.subset import KINDS
from solver.errors import InputError
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore
from tests.plateviz.dashboard.session.test_latest_answer import Executor

SIZE = 30_000


def table_of(name, broken=()):
    """Return rows of a thousand sources; columns rise from -1 to 1, `broken` cannot be read."""

    def read(column):
        if column in broken:
            raise InputError(f"orbit=0001/{column}: damaged")
        return np.arange(SIZE) % 1000 if column == "source_id" else np.linspace(-1.0, 1.0, SIZE)

    has_sources = name != "orbits"
    return ExplorableTable(name, SIZE, COLUMNS_OF_RUN[name], read, has_sources, False)


@pytest.fixture
def broken():
    return set()


@pytest.fixture
def navigation(fit_result, survey, monkeypatch, broken):
    store = SurveyStore(fit_result, [FakeRun("default", survey, fit_result)])
    store.columns, store.background = ColumnCache(), Executor()
    make = lambda run, name, kept: table_of(name, broken)  # noqa: E731
    monkeypatch.setattr(rows_to_explore, "explorable_of_run", make)
    made = Navigation(Session(store))
    made.begin({"view": "survey", "workspace": "explore"})
    return made


@pytest.fixture
def executor(navigation):
    return navigation.session.store.background


@pytest.fixture
def view(navigation):
    made = ExploreView(RunRows(navigation), navigation.session, lambda *_: None, "No rows.")
    made.grid._views[0].visibility.param.update(is_near=True, room=[900, 500])
    return made


def card(view):
    return view.grid._views[0]


def draw(view, executor):
    """Let ticks and threads run until nothing is due."""
    for _ in range(10):
        view.grid.draw_due()
        if not view.grid.is_due:
            return
        while executor.waiting:
            executor.work()
    raise AssertionError("the figure is due for ever")


def title(view):
    return card(view)._body[0].object.children[0][0].title.text


def area(view, x0, x1, y0=-2.0, y1=2.0):
    geometry = {"type": "rect", "x0": x0, "x1": x1, "y0": y0, "y1": y1}
    plot = card(view)._body[0].object.children[0][0]
    event = SelectionGeometry(plot, geometry=geometry, final=True)
    plot._trigger_event(event)


def test_figure_is_drawn_when_its_columns_are_read(view, executor):
    view.grid.draw_due()
    assert view.grid.is_due
    assert len(executor.waiting) == 1
    draw(view, executor)
    assert title(view) == "residual_x against focal_x"


def test_rows_of_a_run_that_was_gone_are_drawn_once_it_is_back(view, executor, navigation, broken):
    navigation.run.is_there, navigation.run.is_replaced = lambda: not broken, lambda: False
    broken.add("nx")
    look_for_run(navigation)
    navigation.survey_exploration.x = "nx"
    draw(view, executor)
    assert "This figure cannot be drawn" in card(view)._body[0].object
    broken.clear()
    look_for_run(navigation)
    draw(view, executor)
    assert title(view) == "residual_x against nx"


def test_figure_on_the_screen_stays_while_the_next_is_made(view, executor, navigation):
    draw(view, executor)
    navigation.survey_exploration.x = "nx"
    view.grid.draw_due()
    assert title(view) == "residual_x against focal_x"
    assert card(view).visibility.is_faded
    navigation.survey_exploration.x = "ny"
    view.grid.draw_due()
    assert len(executor.waiting) == 1
    draw(view, executor)
    assert title(view) == "residual_x against ny"
    assert not card(view).visibility.is_faded


def test_zoom_asks_for_the_part_on_the_screen_and_is_in_the_address(view, executor, navigation):
    draw(view, executor)
    plot = card(view)._body[0].object.children[0][0]
    plot._trigger_event(RangesUpdate(plot, x0=0.0, x1=0.9, y0=0.0, y1=1.0))
    draw(view, executor)
    assert navigation.survey_exploration.limits == ((0.0, 0.9), (0.0, 1.0))
    assert navigation.address()["zoom"] == "0.0~0.9~0.0~1.0"
    assert navigation.workspace is SurveyWorkspace.EXPLORE


def test_zoom_and_area_are_in_the_unit_that_a_person_has_chosen(view, executor, navigation):
    navigation.survey_exploration.param.update(table="sources per orbit")
    draw(view, executor)
    navigation.survey_exploration.param.update(x="offset_ra", y="n_obs")
    draw(view, executor)
    navigation.session.units.unit = "µas"
    draw(view, executor)
    plot = card(view)._body[0].object.children[0][0]
    assert plot.xaxis[0].axis_label.endswith("(µas)")
    assert plot.x_range.end > 1000.0
    area(view, -0.5, 0.5)
    draw(view, executor)
    # The rows between -0.5 and 0.5 µas, and not mas.
    rows = np.linspace(-1.0, 1.0, SIZE)
    inside = np.flatnonzero(np.abs(rows) < 0.5e-3) % 1000
    assert navigation.session.selection.sources == frozenset(inside.tolist())
    plot._trigger_event(RangesUpdate(plot, x0=-500.0, x1=250.0, y0=0.0, y1=1.0))
    assert navigation.survey_exploration.limits == ((-0.5, 0.25), (0.0, 1.0))
    draw(view, executor)
    assert (plot.x_range.start, plot.x_range.end) == (-500.0, 250.0)


def test_address_opens_what_it_says(fit_result, survey, navigation):
    exploration = navigation.survey_exploration
    exploration.table = "sources per orbit"
    exploration.offer(list(COLUMNS_OF_RUN["sources per orbit"]))
    exploration.param.update(x="dec", y="pull_ra", has_median=True)
    again = Navigation(Session(SurveyStore(fit_result, [FakeRun("default", survey, fit_result)])))
    again.begin(navigation.address())
    again.survey_exploration.offer(list(COLUMNS_OF_RUN["sources per orbit"]))
    assert (again.view, again.workspace) == (View.SURVEY, SurveyWorkspace.EXPLORE)
    assert again.survey_exploration.columns() == exploration.columns()
    assert again.exploration.x is None


def test_columns_of_an_older_version_are_named(view, executor, navigation):
    address = navigation.address() | {"rows": "motions", "x": "n_plates", "colour": "sigma_px"}
    navigation.begin(address | {"view": "survey", "workspace": "explore"})
    draw(view, executor)
    notice = navigation.session.notice
    assert "x: expected a column of the motions, found 'n_plates'" in notice
    assert "colour: expected a column of the motions" in notice
    # The next address has none of it.
    navigation.begin(navigation.address())
    assert navigation.session.notice == ""


def test_area_of_cells_selects_the_sources_inside(view, executor, navigation):
    draw(view, executor)
    area(view, 0.0, 1.0 / 60)
    draw(view, executor)
    inside = np.arange(SIZE // 2, SIZE // 2 + 250) % 1000
    assert navigation.session.selection.sources == frozenset(inside.tolist())
    assert not view._words.visible


def test_each_area_selects_anew(view, executor, navigation):
    draw(view, executor)
    for low in (-0.5, 0.1, -0.9, 0.6):
        area(view, low, low + 0.01)
        draw(view, executor)
        rows = np.linspace(-1.0, 1.0, SIZE)
        inside = np.flatnonzero((rows >= low) & (rows < low + 0.01)) % 1000
        assert navigation.session.selection.sources == frozenset(inside.tolist())


def test_area_around_nothing_says_so_and_keeps_the_selection(view, executor, navigation):
    draw(view, executor)
    navigation.session.selection.select_sources(frozenset([3]))
    area(view, 1.5, 1.7)
    draw(view, executor)
    assert navigation.session.selection.sources == {3}
    assert "No row is in that area" in view._words.object


def test_area_with_too_many_sources_says_so_and_keeps_the_selection(
    view, executor, navigation, monkeypatch
):
    monkeypatch.setattr(explore, "MOST_SELECTED", 500)
    draw(view, executor)
    area(view, -2.0, 2.0)
    draw(view, executor)
    assert navigation.session.selection.sources == frozenset()
    assert "1,000 sources" in view._words.object
    assert "at most 500" in view._words.object


def test_column_that_cannot_be_read_is_said_and_the_next_one_is_drawn(
    view, executor, navigation, broken
):
    broken.add("nx")
    draw(view, executor)
    navigation.survey_exploration.x = "nx"
    draw(view, executor)
    assert "orbit=0001/nx: damaged" in card(view)._body[0].object
    navigation.survey_exploration.x = "ny"
    draw(view, executor)
    assert title(view) == "residual_x against ny"


def test_rows_are_limited_by_a_column(view, executor, navigation):
    draw(view, executor)
    low, high = view._limits
    assert [one.visible for one in (low, high)] == [False, False]
    navigation.survey_exploration.only = "leverage"
    draw(view, executor)
    assert low.visible
    assert [(one.value, one.placeholder) for one in (low, high)] == [("", "-1"), ("", "1")]
    exploration = navigation.survey_exploration
    low.value = "wide"
    assert (low.error_state, low.helper_text) == (True, "Expected a number.")
    assert exploration.lowest == -math.inf
    low.value = "0e3"
    assert (low.error_state, low.helper_text) == (False, "")
    assert (exploration.lowest, exploration.highest) == (0.0, math.inf)
    draw(view, executor)
    assert "15,000 not between the limits of leverage" in view._drawn.figure[0].subtitle
    navigation.survey_exploration.only = "nx"
    draw(view, executor)
    assert low.value == ""
    assert exploration.lowest == -math.inf


@pytest.fixture
def of_orbit(navigation, monkeypatch):
    """The workspace of an orbit with a measurement of each source on each detector, in cells."""
    navigation.open_orbit(0)
    result = navigation.session.shown.result
    rows = pd.concat([result.residuals] * (ROW_LIMIT // len(result.residuals) + 2))
    many = replace(result, residuals=rows.reset_index(drop=True))
    monkeypatch.setattr(
        rows_to_explore,
        "EXPLORABLE",
        {"measurements": lambda _: explorable("measurements", many.residuals, RESIDUALS)},
    )
    made = ExploreView(OrbitRows(navigation), navigation.session, lambda *_: None, "No rows.")
    made.grid._views[0].visibility.param.update(is_near=True, room=[900, 500])
    return made


@pytest.mark.parametrize("kind", KINDS)
def test_drag_selects_what_is_chosen(of_orbit, executor, navigation, kind):
    draw(of_orbit, executor)
    assert of_orbit._selects.visible
    navigation.exploration.param.update(x="plate_id", y="detector_id", selects=kind)
    draw(of_orbit, executor)
    area(of_orbit, 0.5, 1.5, -0.5, 0.5)
    draw(of_orbit, executor)
    rows = navigation.session.shown.result.residuals.query("plate_id == 1 and detector_id == 0")
    expected = {
        "sources": frozenset(rows["source_id"].tolist()),
        "exposures": frozenset(zip(rows["field_id"], rows["plate_id"], strict=True)),
        "detectors": frozenset([0]),
    }
    selected = navigation.session.selection.selected.by_kind()
    assert selected == {one: expected[one] if one == kind else frozenset() for one in KINDS}
    (frame,) = of_orbit._drawn.figure
    assert len(frame[f"selected {kind}"].values("x")) > 0
    assert navigation.exploration.address().get("selects", "sources") == kind


def test_run_that_grows_is_read_again(view, executor, navigation):
    draw(view, executor)
    navigation.run_progress = navigation.run_progress._replace(n_fitted=5)
    card(view).change("light")
    view.grid.draw_due()
    assert len(executor.waiting) == 1
    draw(view, executor)


def test_too_many_rows_are_not_saved(view, executor, navigation, monkeypatch):
    draw(view, executor)
    monkeypatch.setattr(explored_file, "_MOST_SAVED", 1000)
    with pytest.raises(InputError, match="30,000 rows are too many to save"):
        view._rows()
    navigation.survey_exploration.limits = ((0.0, 0.01), (0.0, 0.01))
    draw(view, executor)
    (rows,) = view._rows().values()
    assert rows.colnames == ["source_id", "orbit_id", "focal_x", "residual_x"]
    assert 100 < len(rows) < 200


def test_orbit_without_a_solution_has_no_rows(navigation):
    assert OrbitRows(navigation).request() is None
