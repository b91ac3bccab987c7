"""FigureView: drawn once when near the screen, then followed in place; faded while out of date."""

import gc
import time
import weakref

import numpy as np
import pandas as pd
import pytest
from bokeh.events import RangesUpdate, Reset, SelectionGeometry

from plateviz.dashboard.views.cards.figure import FigureView
from plateviz.dashboard.views.cards.figure_grid import FigureGrid
from plateviz.dashboard.views.cards.point_actions import PointActions
from plateviz.figures import glyphs
from plateviz.figures.figure import Axis, Figure, Ramp, framed
from plateviz.figures.glyphs import points
from plateviz.plots.diagnostic import Chosen
from plateviz.plots.elements.arrows import Field, arrows
from plateviz.plots.gallery import diagnostics


def figure_of(ids):
    table = pd.DataFrame({"x": range(len(ids)), "y": 1.0, "id": ids})
    marks = points(table, "x", "y", name="sources", color="mark", hover=[("source", "@{id}")])
    axes = {"x": Axis("x (mm)", (0.0, 9.0)), "y": Axis("y (mm)", (0.0, 2.0))}
    return framed([marks], title=f"{len(ids)} sources", width=200, height=100, **axes)


@pytest.fixture
def drawn():
    return []


@pytest.fixture
def view(drawn):
    def draw():
        drawn.append(figure_of(["7", "8", "9"][: 1 + len(drawn)]))
        return drawn[-1]

    return FigureView(diagnostics()[0], draw, waiting="Nothing yet.")


def come_near(view, room=(500, 400)):
    view.visibility.param.update(is_near=True, room=list(room))


def plot(view):
    return view._body[0].object.children[0][0]


def is_faded(view):
    return view.visibility.is_faded


def text(view):
    return view._body[0].object


def test_figure_is_due_only_near_the_screen(view):
    assert not view.is_due
    view.visibility.is_near = True
    assert not view.is_due
    come_near(view)
    assert view.is_due
    view.draw()
    assert not view.is_due


def test_grid_begins_with_the_rooms_that_an_earlier_page_had(view, monkeypatch):
    noted = []
    grid = FigureGrid([view], lambda *_: None)
    grid.begin_with({grid.cards[0]: (500, 400)}, lambda *told: noted.append(told))
    assert view.is_due
    come_near(view)
    assert noted == []
    come_near(view, (510, 400))
    assert noted == [(diagnostics()[0].name, (510, 400))]
    # Later it is a person who changes the room.
    now = time.monotonic()
    monkeypatch.setattr(time, "monotonic", lambda: now + 60.0)
    come_near(view, (1900, 1000))
    assert len(noted) == 1


def test_grid_without_rooms_notes_those_of_its_cards(view):
    noted = []
    grid = FigureGrid([view], lambda *_: None)
    grid.begin_with({}, lambda *told: noted.append(told))
    assert not view.is_due
    view.visibility.room = [500, 400]
    view.visibility.is_near = True
    assert noted == [(diagnostics()[0].name, (500, 400))]


def test_drawn_figure_follows_its_room_without_being_plotted_again(view, drawn):
    come_near(view)
    view.draw()
    assert plot(view).frame_width < 500
    come_near(view, (900, 400))
    assert view.is_due
    view.draw()
    assert 800 < plot(view).frame_width < 900
    assert not view.is_due
    assert len(drawn) == 1


def test_change_away_from_the_screen_waits_and_fades_the_figure(view, drawn):
    come_near(view)
    view.draw()
    assert not is_faded(view)
    view.visibility.is_near = False
    view.change("dark")
    assert not view.is_due
    assert is_faded(view)
    view.visibility.is_near = True
    view.draw()
    assert not is_faded(view)
    assert len(drawn) == 2


def test_drawn_figure_follows_in_place(view):
    come_near(view)
    view.draw()
    first = plot(view)
    assert first.renderers[0].data_source.data["id"].tolist() == ["7"]
    assert first.background_fill_color == "#ffffff"
    view.change("dark")
    view.draw()
    assert plot(view) is first
    assert first.title.text == "2 sources"
    assert first.renderers[0].data_source.data["id"].tolist() == ["7", "8"]
    assert first.background_fill_color == "#121212"


def test_tapped_orbit_is_opened_once_and_not_selected():
    opened = []
    view = FigureView(
        diagnostics()[0], lambda: figure_of(["7", "8"]), actions=PointActions({"id": opened.append})
    )
    view.draw()
    view.draw()
    source = plot(view).renderers[0].data_source
    source.selected.indices = [1]
    assert opened == ["8"]
    assert source.selected.indices == []
    (tool,) = [tool for tool in plot(view).tools if type(tool).__name__ == "TapTool"]
    assert tool.renderers == plot(view).renderers


def test_sources_are_selected_and_shown_as_selected_when_drawn_next():
    chosen = []
    rows = ["7", "8", "7", "9"]
    view = FigureView(
        diagnostics()[0], lambda: figure_of(rows), actions=PointActions(select=chosen.append)
    )
    come_near(view)
    view.draw()
    source = plot(view).renderers[0].data_source
    source.selected.indices = [1, 2]
    assert chosen == [frozenset({7, 8})]
    view.show_selected({"id": frozenset({"7", "8"})})
    assert view.is_due
    view.draw()
    assert not view.is_due
    assert source.selected.indices == [0, 1, 2]
    assert len(chosen) == 1
    rows.reverse()
    view.change("dark")
    view.draw()
    assert source.selected.indices == [1, 2, 3]
    view.show_selected({})
    view.draw()
    assert source.selected.indices == []
    assert len(chosen) == 1


def test_next_selection_in_a_map_of_arrows_replaces_the_first():
    table = pd.DataFrame({"x": [0.0, 1.0], "y": 0.0, "u": 0.1, "v": 0.1, "id": ["7", "8"]})
    field = Field((0.0, 9.0), (0.0, 9.0))
    axes = {"x": Axis("x (mm)", field.x), "y": Axis("y (mm)", field.ylim)}
    marks = arrows(table, scale=1.0, field=field, colour="mark", hover=[])
    chosen = []
    view = FigureView(
        diagnostics()[0],
        lambda: framed(marks, title="Arrows", width=200, **axes),
        actions=PointActions(select=chosen.append),
    )
    come_near(view)
    view.draw()
    shafts, tails = (renderer.data_source for renderer in plot(view).renderers)
    tails.selected.indices = [0]
    view.show_selected({"id": frozenset({"7"})})
    view.draw()
    # The shaft and both strokes of the head, whose ids are not sent to the browser.
    assert "id" not in shafts.data
    assert shafts.selected.indices == [0, 2, 3]
    tails.selected.indices = [1]
    assert chosen == [frozenset({7}), frozenset({8})]
    tails.selected.indices = [0, 99]
    assert chosen[-1] == frozenset({7})


def selecting(table, hover):
    """A drawn figure of points, and what has been selected in it, by the kind."""
    chosen = []
    marks = points(table, "x", "y", name="marks", color="mark", hover=hover)
    axes = {"x": Axis("x (mm)", (0.0, 9.0)), "y": Axis("y (mm)", (0.0, 2.0))}
    actions = PointActions(
        select=lambda items: chosen.append(("sources", items)),
        select_exposures=lambda items: chosen.append(("exposures", items)),
        select_detectors=lambda items: chosen.append(("detectors", items)),
    )
    figure = framed([marks], title="Marks", width=200, height=100, **axes)
    view = FigureView(diagnostics()[0], lambda: figure, actions=actions)
    come_near(view)
    view.draw()
    return view, plot(view).renderers[0].data_source, chosen


def test_points_beside_selected_ones_of_another_table_are_faded():
    axes = {"x": Axis("x (mm)", (0.0, 9.0)), "y": Axis("y (mm)", (0.0, 2.0))}
    tables = [
        points(
            pd.DataFrame({"x": [0.0, 1.0], "y": 1.0, "id": ids}),
            *("x", "y"),
            name=name,
            color="mark",
            hover=[("source", "@{id}")],
        )
        for name, ids in {"first": ["7", "8"], "second": ["9", "10"]}.items()
    ]
    figure = framed(tables, title="Classes", width=200, height=100, **axes)
    view = FigureView(diagnostics()[0], lambda: figure, actions=PointActions(select=print))
    come_near(view)
    view.draw()

    def faded(*ids):
        view.show_selected({"id": frozenset(ids)})
        view.draw()
        return [renderer.muted for renderer in plot(view).renderers]

    assert faded("8") == [False, True]
    assert faded("8", "9") == [False, False]
    # Where nothing stands out, nothing is faded.
    assert faded("11") == [False, False]
    assert faded() == [False, False]


def test_frame_without_what_is_selected_in_another_one_is_not_faded():
    axes = {"x": Axis("x (mm)", (0.0, 9.0)), "y": Axis("y (mm)", (0.0, 2.0))}
    rows = pd.DataFrame({"x": [0.0, 1.0], "y": 1.0, "id": ["7", "8"]})
    frames = []
    for there in (rows, rows[1:]):
        table = points(there, "x", "y", name="one", color="mark", hover=[("source", "@{id}")])
        frames += framed([table], title="(A)", width=200, height=100, **axes).frames
    view = FigureView(
        diagnostics()[0], lambda: Figure(tuple(frames)), actions=PointActions(select=print)
    )
    come_near(view)
    view.draw()
    view.show_selected({"id": frozenset({"7"})})
    view.draw()
    shown = [glyphs for frame in view._actions._selectable for glyphs in frame]
    assert [glyphs.source.selected.indices for glyphs in shown] == [[0], []]
    assert [glyphs.renderer.muted for glyphs in shown] == [False, False]


EXPOSURES = ["field 0, exposure 3", "field 0, exposure 4", "field 0, exposure 3"]


def measurements(**columns):
    return pd.DataFrame({"x": [0.0, 1.0, 2.0], "y": 1.0, "exposure": EXPOSURES, **columns})


def test_points_without_sources_select_exposures_or_detectors():
    _, source, chosen = selecting(measurements(), [("exposure", "@{exposure}")])
    source.selected.indices = [0, 1]
    assert chosen == [("exposures", frozenset({(0, 3), (0, 4)}))]
    # A point of an exposure on a detector is one of the exposure.
    hover = [("exposure", "@{exposure}"), ("detector", "@{detector_id}")]
    _, source, chosen = selecting(measurements(detector_id=[2, 2, 1]), hover)
    source.selected.indices = [0]
    assert chosen == [("exposures", frozenset({(0, 3)}))]
    hover = [("detector", "@{detector_id}")]
    _, source, chosen = selecting(measurements(detector_id=[2, 2, 1]), hover)
    source.selected.indices = [0, 1]
    assert chosen == [("detectors", frozenset({2}))]


def test_tap_on_an_outline_of_the_footprint_selects_the_detector(fit_result, instrument):
    footprint = diagnostics()[0]
    chosen = []
    actions = PointActions(
        select=lambda items: chosen.append(("sources", items)),
        select_detectors=lambda items: chosen.append(("detectors", items)),
    )
    figure = footprint.plot(Chosen(fit_result, instrument))
    view = FigureView(footprint, lambda: figure, actions=actions)
    come_near(view)
    view.draw()
    named = {one.name: one for one in plot(view).renderers}
    handles, outlines, sources = (named[name] for name in ("handles", "outlines", "sources"))
    by_type = {type(tool).__name__: tool for tool in plot(view).tools}
    assert by_type["TapTool"].renderers == [handles, sources]
    # A box among the sources leaves the detectors.
    assert by_type["BoxSelectTool"].renderers == [sources]
    ids = outlines.data_source.data["detector_id"]
    (second,) = {d.detector_id for d in instrument.detectors[1:2]}
    handles.data_source.selected.indices = [list(ids).index(second)]
    # The same tap has hit a star below the line, which it was not meant for.
    sources.data_source.selected.indices = [3]
    assert chosen == [("detectors", frozenset({second}))]
    assert sources.data_source.selected.indices == []
    view.show_selected({"detector_id": frozenset({str(second)})})
    view.draw()
    # It stands out in every field; what is tapped is never seen.
    assert outlines.data_source.selected.indices == np.flatnonzero(ids == second).tolist()
    assert len(outlines.data_source.selected.indices) == 4
    assert outlines.nonselection_glyph is not None
    assert handles.nonselection_glyph is None
    assert sources.data_source.selected.indices == []
    handles.data_source.selected.indices = []
    assert chosen[1:] == [("detectors", frozenset())]
    actions._outline_until = 0.0
    sources.data_source.selected.indices = [3]
    assert [kind for kind, _ in chosen] == ["detectors", "detectors", "sources"]


def test_measurement_stands_out_for_its_source_exposure_or_detector():
    hover = [(name, f"@{{{name}}}") for name in ("id", "exposure", "detector_id")]
    table = measurements(id=["7", "8", "9"], detector_id=[0, 1, 2])
    view, source, chosen = selecting(table, hover)
    view.show_selected({"exposure": frozenset({EXPOSURES[0]}), "detector_id": frozenset({"1"})})
    view.draw()
    assert source.selected.indices == [0, 1, 2]
    view.show_selected({"exposure": frozenset({EXPOSURES[0]})})
    view.draw()
    assert source.selected.indices == [0, 2]
    # A row that is added does not select the sources of those that stand out for their exposure.
    source.selected.indices = [0, 1, 2]
    assert chosen == [("sources", frozenset({8}))]


def test_other_rows_of_what_is_selected_again_stay_marked():
    view, source, chosen = selecting(measurements(), [("exposure", "@{exposure}")])
    view.show_selected({"exposure": frozenset({EXPOSURES[0]})})
    view.draw()
    source.selected.indices = [2]
    assert chosen == [("exposures", frozenset({(0, 3)}))]
    assert source.selected.indices == [0, 2]


def test_stale_figure_is_faded(view):
    view.draw()
    view.mark_stale(True)
    assert is_faded(view)
    view.mark_stale(False)
    assert not is_faded(view)


def test_figure_is_explained_in_words_and_as_tables(view, monkeypatch):
    tools, sent = view._tools, []
    monkeypatch.setattr(tools, "_send_msg", sent.append)
    tools._handle_msg("tables")
    assert (tools.summary, sent.pop()) == ("", {"tables": []})
    come_near(view)
    view.draw()
    assert tools.summary == "1 sources. y (mm) against x (mm): 1 point (sources)."
    tools._handle_msg("tables")
    ((table,),) = (message["tables"] for message in sent)
    assert table["rows"] == [["0", "1", "7"]]
    # What a browser of ours never sends.
    tools._handle_msg({"tables": 1})
    assert len(sent) == 1
    model = tools.get_root()
    assert model.data.equation == diagnostics()[0].equation
    assert model.data.place == "assets/docs/diagnostics.md, “Footprint”"


def test_empty_card_has_the_waiting_text():
    view = FigureView(diagnostics()[0], lambda: None, waiting="Nothing yet.")
    assert "Being drawn." in text(view)
    view.draw()
    assert "Nothing yet." in text(view)


def test_figure_that_fails_shows_the_reason_and_is_not_drawn_again():
    def draw():
        raise ValueError("no sources")

    view = FigureView(diagnostics()[0], draw)
    view.visibility.is_near = True
    view.draw()
    assert "This figure cannot be drawn: no sources" in text(view)
    assert not view.is_due


def test_grid_draws_a_few_figures_near_the_screen_at_a_time():
    drawn = []
    views = [
        FigureView(diagnostic, lambda name=diagnostic.name: drawn.append(name))
        for diagnostic in diagnostics()[:6]
    ]
    calls = []
    grid = FigureGrid(views, lambda *events: calls.extend(events))
    assert not grid.is_due
    for view in views[1:]:
        come_near(view)
    assert len(calls) >= 5
    grid.draw_due()
    assert grid.is_due
    assert drawn == [d.name for d in diagnostics()[1 : 1 + len(drawn)]]
    for _ in views:
        grid.draw_due()
    assert not grid.is_due
    assert sorted(drawn) == sorted(d.name for d in diagnostics()[1:6])


def cells():
    ramp = Ramp("count", "count", (0.0, 1.0))
    image = glyphs.image(np.eye(2), (0.0, 9.0), (0.0, 2.0), name="cells", ramp=ramp)
    axes = {"x": Axis("x (mm)", (0.0, 9.0)), "y": Axis("y (mm)", (0.0, 2.0))}
    return framed([image], title="Cells", width=200, height=100, **axes)


def area_of(plot, **geometry):
    return SelectionGeometry(plot, geometry=geometry, final=True)


def test_area_is_selected_where_there_are_no_points():
    areas, shown = [], [cells()]
    view = FigureView(
        diagnostics()[0], lambda: shown[-1], actions=PointActions(select_area=areas.append)
    )
    come_near(view)
    view.draw()
    drawn = plot(view)
    drawn._trigger_event(area_of(drawn, type="rect", x0=1.0, x1=2.0, y0=0.5, y1=1.0))
    drawn._trigger_event(area_of(drawn, type="poly", x=[1, 2, 3], y=[0, 1, 0]))
    assert [area.tolist() for area in areas] == [
        [[1.0, 0.5], [2.0, 0.5], [2.0, 1.0], [1.0, 1.0]],
        [[1.0, 0.0], [2.0, 1.0], [3.0, 0.0]],
    ]
    turns = np.linspace(0.0, 6.0, 100_000)
    drawn._trigger_event(area_of(drawn, type="poly", x=list(np.cos(turns)), y=list(np.sin(turns))))
    assert 300 < len(areas.pop()) <= 500
    # What a browser of ours never sends.
    for geometry in ({"type": "rect"}, {"type": "poly", "x": [1], "y": []}, {"type": "point"}):
        drawn._trigger_event(area_of(drawn, **geometry))
    # Points answer by themselves.
    shown.append(figure_of(["7", "8"]))
    view.change("light")
    view.draw()
    drawn._trigger_event(area_of(drawn, type="rect", x0=1.0, x1=2.0, y0=0.5, y1=1.0))
    assert len(areas) == 2


def test_zoom_is_told_and_a_reset_too():
    zooms = []
    view = FigureView(diagnostics()[0], cells, zoom=zooms.append)
    come_near(view)
    view.draw()
    view.draw()
    drawn = plot(view)
    drawn._trigger_event(RangesUpdate(drawn, x0=1.0, x1=2.0, y0=0.5, y1=1.0))
    drawn._trigger_event(Reset(drawn))
    drawn._trigger_event(RangesUpdate(drawn, x0=None, x1=2.0, y0=0.5, y1=1.0))
    assert zooms == [((1.0, 2.0), (0.5, 1.0)), None, None]
    assert type(drawn.toolbar.active_scroll).__name__ == "WheelZoomTool"


def test_frames_that_a_figure_no_longer_has_are_forgotten():
    numbers = iter([1, 2, 1])

    def draw():
        (frame,) = figure_of(["7"])
        return Figure((frame,) * next(numbers))

    view = FigureView(diagnostics()[0], draw, actions=PointActions(select=lambda _: None))
    come_near(view)
    view.draw()
    first = weakref.ref(plot(view))
    for _ in range(2):
        view.change("light")
        view.draw()
    gc.collect()
    assert first() is None
