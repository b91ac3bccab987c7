"""SelectionBar: the selection in words, what is saved of it, and what it offers."""

from types import SimpleNamespace

import numpy as np
import panel as pn
import pytest
from bokeh.document import Document
from panel.io.state import set_curdoc

from plateviz.dashboard.navigation.navigation import View
from plateviz.dashboard.navigation.saved_view import view_text
from plateviz.dashboard.saving.selected_tables import selected_tables
from plateviz.dashboard.saving.table_sender import TableSender
from plateviz.dashboard.session.drawn_area import DrawnArea
from plateviz.dashboard.views.controls.selection_bar import SelectionBar, is_read_here, words
from plateviz.dashboard.views.dialogs.selection_list import SelectionList
from plateviz.dashboard.views.panes.calibration import CalibrationView
from solver.data.subset import NOTHING, Subset
from solver.errors import InputError

SOURCES = Subset(frozenset(range(132)))
MIXED = Subset(frozenset(range(132)), frozenset({(0, 3)}))


@pytest.mark.parametrize(
    ("in_orbit", "text"),
    [
        (SOURCES, "132 sources selected"),
        (Subset(frozenset(range(57))), "132 sources selected, 57 sources in this orbit"),
        (NOTHING, "132 sources selected, none in this orbit"),
        (None, "132 sources selected"),
    ],
)
def test_selection_in_words(in_orbit, text):
    assert words(SOURCES, in_orbit) == text


def test_kinds_are_named_one_after_the_other():
    text = "132 sources, exposure 0/3 selected, exposure 0/3 in this orbit"
    assert words(MIXED, Subset(exposures=MIXED.exposures)) == text


@pytest.fixture
def session(navigation):
    """A session with the solution of an orbit on the screen."""
    navigation.open_orbit(0)
    assert navigation.view is View.ORBIT
    return navigation.session


def shown(bar):
    return [part.label for part in bar.__panel__() if getattr(part, "label", "") and part.visible]


def test_bar_says_that_an_area_was_empty_until_something_is_done(navigation, session):
    bar, area = SelectionBar(navigation), DrawnArea(session)
    for forget in (
        lambda: session.selection.select_sources(frozenset({1})),
        lambda: navigation.turn_to(View.SOURCE),
        lambda: area.end(has_points=True),
    ):
        session.selection.select_sources(frozenset())
        navigation.turn_to(View.ORBIT)
        area.end(has_points=False)
        (remark,) = bar.__panel__()
        assert remark.object == "There are no points in that area; nothing is selected"
        forget()
        assert remark not in list(bar.__panel__())


def test_bar_says_that_an_empty_area_has_left_the_selection(navigation, session):
    bar, area = SelectionBar(navigation), DrawnArea(session)
    session.selection.select(MIXED)
    area.begin()
    # What the browser tells first.
    session.selection.select_sources(frozenset())
    area.end(has_points=False)
    assert session.selection.selected == MIXED
    told = "There are no points in that area; what was selected stays selected"
    assert bar._words.object == told
    assert "Clear" in shown(bar)
    session.selection.select_detectors(frozenset({1}))
    assert "detector 1 selected" in bar._words.object
    bar._actions.clear()
    assert not session.selection.selected


def test_bar_offers_what_can_be_done(navigation, session):
    bar = SelectionBar(navigation)
    assert len(bar.__panel__()) == 0
    session.selection.select_exposures(frozenset({(0, 1)}))
    assert shown(bar) == ["List", "Leave out of the fit", "Invert", "Keep", "Clear"]
    session.choices.exclusions = "exposure=0/1"
    assert "Put back into the fit" in shown(bar)
    session.selection.kept = {"one": session.selection.selected}
    session.selection.select(NOTHING)
    assert shown(bar) == ["Kept selections"]


def test_all_measurements_of_what_is_selected_are_saved(navigation, session, fit_result):
    source = int(fit_result.sources["source_id"].iloc[3])
    session.selection.select(Subset(frozenset({source}), frozenset({(0, 1)}), frozenset({2})))
    tables = selected_tables(navigation)
    rows = fit_result.residuals
    expected = (
        (rows["source_id"] == source)
        | ((rows["field_id"] == 0) & (rows["plate_id"] == 1))
        | (rows["detector_id"] == 2)
    )
    assert len(tables["measurements"]) == expected.sum()
    assert tables["sources"]["source_id"].tolist() == [source]
    assert tables["exposures"]["plate_id"].tolist() == [1]


def test_250_000_sources_are_selected_listed_and_refused_where_they_are_too_many(
    navigation, session, fit_result
):
    bar, listed = SelectionBar(navigation), SelectionList(navigation)
    measured = fit_result.sources["source_id"].tolist()
    others = 250_000 - len(measured)
    session.selection.select_sources(frozenset([*measured, *range(10**17, 10**17 + others)]))
    assert bar._words.object == f"250,000 sources selected, {len(measured)} sources in this orbit"
    # Every figure shares the names of what is selected.
    assert session.selection.ids is session.selection.ids
    assert navigation.address()["sources"].startswith("many:")
    listed.open()
    assert listed._dialog[0].object.startswith("Sources (a click opens")
    assert len(listed._tables["sources"]._table.value) == len(measured)
    assert len(selected_tables(navigation)["sources"]) == len(measured)
    with pytest.raises(InputError, match="250,000 are selected: save these as a table"):
        view_text(navigation)
    bar._actions.leave_out()
    assert session.choices.settings().exclusions.sources == frozenset(measured)
    assert session.selection.sources >= frozenset(measured)


def test_rows_of_the_calibration_tables_select_and_are_selected(session, fit_result):
    view = CalibrationView(session)
    exposures, detectors = (rows.table for rows in view._rows)
    exposures.selection = [0, 2]
    keys = fit_result.exposures[["field_id", "plate_id"]].to_numpy()[[0, 2]]
    assert session.selection.exposures == frozenset(map(tuple, keys.tolist()))
    session.selection.select_detectors(frozenset({3}))
    assert detectors.selection == [3]
    assert exposures.selection == [0, 2]
    label = exposures.value["element"].iloc[2]
    assert label == "field {}, exposure {}".format(*keys[1])
    assert np.all(detectors.value["element"] == [f"detector {n}" for n in range(4)])


@pytest.fixture
def bar(navigation, session, fit_result):
    made = SelectionBar(navigation)
    ids = fit_result.sources["source_id"].iloc[:2].tolist()
    session.selection.select_sources(frozenset(ids))
    return made


def test_sources_are_sent_from_a_page_on_this_machine(bar, monkeypatch):
    sent = []
    monkeypatch.setattr(TableSender, "send", lambda _, *what: sent.append(what) or "2 sent.")
    bar._is_here = True
    assert bar._send().make(print).text == "2 sent."
    ((table, name),) = sent
    assert (len(table), name) == (2, "orbit-0-selection")


def test_page_on_another_machine_says_why_nothing_is_sent(bar):
    bar._is_here = False
    with pytest.raises(InputError, match="on another machine or through a proxy; Save, VOTable"):
        bar._send()


def test_what_was_sent_is_removed_with_the_session(navigation, monkeypatch):
    closed = []
    monkeypatch.setattr(TableSender, "close", lambda _: closed.append(1))
    document = Document()
    with set_curdoc(document):
        SelectionBar(navigation)
    assert closed == []
    for end in document.callbacks.session_destroyed_callbacks:
        end(None)
    assert closed == [1]


def test_request_of_a_session_tells_where_its_page_is_read(monkeypatch):
    for address, is_here in (("127.0.0.1", True), ("192.0.2.7", False)):
        request = SimpleNamespace(remote_ip=address, headers={"Host": "localhost:5006"})
        document = SimpleNamespace(session_context=SimpleNamespace(request=request))
        monkeypatch.setattr(type(pn.state), "curdoc", document)
        assert is_read_here() is is_here
