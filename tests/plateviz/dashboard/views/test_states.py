"""Every pane says whether it is loading, ready, out of date, failed or empty, and what to do."""

from dataclasses import replace

import pytest

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.navigation.view import View
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.stage import Stage
from plateviz.dashboard.views.browser.address_bar import AddressBar
from plateviz.dashboard.views.cards.figure import FigureView
from plateviz.dashboard.views.controls.refit import RefitView
from plateviz.dashboard.views.pages.orbit import OrbitPage
from plateviz.dashboard.views.pages.source import SourcePage
from plateviz.dashboard.views.pages.survey import SurveyPage
from plateviz.dashboard.views.panes.calibration import CalibrationView
from plateviz.dashboard.views.panes.summary import HeadView, StripView
from plateviz.plots.gallery import diagnostics
from plateviz.plots.workspace import OrbitWorkspace, SurveyWorkspace
from plateviz.runs.scratch_result import (
    read_scratch_result,
    write_eigenmodes,
    write_scratch_result,
)
from plateviz.solving.run_reader import RunReader
from solver.errors import InputError
from tests.plateviz.dashboard.fake_store import finish
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore
from tests.plateviz.solving.waiting import Waiting

LOADING = "The first solution is being computed."
STALE = "Another solution is being computed"


def wake(*_):
    """Nothing is drawn in these tests unless they say so."""


@pytest.fixture
def fresh(fit_result):
    """A page whose first solution is being computed."""
    store = SurveyStore(fit_result, [])
    store.orbits = [*store.orbits]
    navigation = Navigation(Session(store))
    navigation.begin({"view": "orbit"})
    return navigation


def tables(view):
    """Words and tabs of the view of the calibration."""
    return view.__panel__()[0], view.__panel__()[-1]


def figure(page, name="residual-map"):
    (view,) = (one for one in page.figures._views if one.card_name == name)
    view.visibility.param.update(is_near=True, room=[500, 400])
    view.draw()
    return view


def test_panes_of_an_orbit_go_through_their_states(fresh):
    session = fresh.session
    (head, outdated), strip = HeadView(fresh).__panel__(), StripView(session).__panel__()
    calibration, page = CalibrationView(session), OrbitPage(fresh, wake)
    words, tabs = tables(calibration)
    view = figure(page)
    assert session.stage is Stage.LOADING
    assert LOADING in head.object
    assert LOADING in words.object
    assert LOADING in view._body[0].object
    assert (strip.object, tabs.visible) == ("", False)

    finish(session)
    view.draw()
    assert "verdict" in head.object
    assert "cell" in strip.object
    assert (words.visible, tabs.visible) == (False, True)
    assert view._tools.summary.startswith("Residuals on detector")

    session.refit()
    assert session.stage is Stage.STALE
    assert f"{STALE}: {session.message}." in outdated.object
    assert STALE in words.object
    assert "stale" in strip.object
    assert view._tools.is_stale

    session.job.take({"event": "failed", "message": "orbit <0>: no exposure"})
    session.poll()
    for pane in (outdated, words):
        assert "The last request has no solution, and this one stays:" in pane.object
        assert "<0>" not in pane.object
    assert not view._tools.is_stale
    assert tabs.visible


def test_nothing_is_said_of_a_what_if_that_has_only_begun(fresh, monkeypatch):
    session = fresh.session
    outdated, refit = HeadView(fresh).__panel__()[1], RefitView(fresh)
    finish(session)
    session.choices.order = 3
    assert session.stage is Stage.STALE
    assert session.message
    assert (outdated.visible, refit._message.visible) == (False, False)
    # What is refused is told at once.
    session.refuse("no exposure")
    assert (outdated.visible, refit._message.visible) == (True, True)
    session.follow(session.job, stage=Stage.STALE)
    monkeypatch.setattr(type(session.job), "seconds", 1.6)
    session.poll()
    assert (outdated.visible, refit._message.visible) == (True, True)
    assert f"{STALE}: {session.message}." in outdated.object


def test_solution_is_shown_while_it_is_being_judged(fresh):
    session = fresh.session
    session.store.judge.has_judged = lambda _: False
    head, strip = HeadView(fresh).__panel__()[0], StripView(session).__panel__()
    finish(session)
    page = OrbitPage(fresh, wake)
    fresh.turn_to_workspace(OrbitWorkspace.PATTERNS)
    tests = figure(page, "solution-tests")
    assert "This solution is being judged." in head.object
    assert "cell" in strip.object
    assert tests.is_pending
    fresh.turn_to_workspace(OrbitWorkspace.ORDERS)
    session.compare_with(session.shown._replace(orbit=5))
    assert "The solutions are being judged." in page._compare._table.object
    session.figure_of_both = "solution-tests"
    both = figure(page, "both-solutions")
    both.draw()
    assert both.is_pending

    # Of one that is judged, nothing waits for the other.
    session.store.judge.has_judged = lambda result: result is session.shown.result
    session.other = session.other._replace(result=replace(session.other.result))
    assert "<summary>This solution" in head.object
    assert "The solutions are being judged." in page._compare._table.object

    session.store.judge.has_judged = lambda _: True
    session.judging.look()
    assert "<summary>This solution" in head.object
    assert "Verdict" in page._compare._table.object
    tests.draw()
    assert tests.is_drawn


def test_figure_of_both_solutions_follows_the_address(fresh):
    finish(fresh.session)
    page = OrbitPage(fresh, wake)
    fresh.turn_to_workspace(OrbitWorkspace.ORDERS)
    both = figure(page, "both-solutions")
    bar = AddressBar(fresh)
    assert "both=residual-map" in bar.query
    query = bar.query.replace("both=residual-map", "both=exposure-tracks")
    bar._handle_msg({"number": 1, "query": query})
    assert page._compare._figure.value == page._compare.figure.name == "exposure-tracks"
    assert both.is_due
    page._compare._figure.value = "residual-map"
    assert "both=residual-map" in bar.query


def test_two_solutions_that_are_exchanged_are_no_step_of_the_history(fresh):
    session = fresh.session
    finish(session)
    bar = AddressBar(fresh)
    first = session.shown
    session.open_listed(first._replace(settings=first.settings.with_(order=3)))
    assert "solution=order=3" in bar.query
    assert not bar.is_blink
    session.exchange()
    assert "solution=order=3" not in bar.query
    assert bar.is_blink
    session.exchange()
    assert bar.is_blink
    session.open_listed(first._replace(settings=first.settings.with_(order=4)))
    assert not bar.is_blink


def test_solution_is_shown_with_the_name_that_a_person_gives_it(fresh):
    session = fresh.session
    head, choice = HeadView(fresh).__panel__()[0], RefitView(fresh)._solutions
    finish(session)
    (made,) = session.journal.made
    session.journal.rename(made, "<first>")
    assert "Solution of orbit 0:</span> <b>&lt;first&gt;: order 5</b>" in head.object
    assert list(choice.options) == ["<first>: order 5"]
    session.journal.rename(made, "mine")
    of_run = session.shown._replace(run="default")
    session.compare_with(of_run)
    assert "<b>mine: order 5</b>" in head.object
    # The solution of a run has the same settings, and is another one.
    assert "<b>order 5</b>" in head.object


def test_solution_of_another_run_is_among_those_to_choose_while_it_is_shown(fresh):
    session = fresh.session
    finish(session)
    choice = RefitView(fresh)._solutions
    shown = session.shown
    other = shown._replace(settings=shown.settings.with_(order=3), run="second")
    session.compare_with(other)
    assert (choice.value, list(choice.options.values())) == (shown, [shown])
    session.exchange()
    # The browser would choose the first of the options, and the page would show that.
    assert (choice.value, list(choice.options.values())) == (other, [shown, other])
    session.exchange()
    assert choice.value == shown


def test_only_what_shows_eigenmodes_waits_for_them(fresh, tmp_path):
    session, asked = fresh.session, []
    finish(session)
    page = OrbitPage(fresh, wake)
    whole = session.shown.result
    tables = {
        name: getattr(whole, name) for name in ("eigenmodes", "mode_parameters", "mode_shifts")
    }
    partial = replace(whole, **dict.fromkeys(tables))
    write_scratch_result(tmp_path / "result", partial, is_partial=True)
    what_if = read_scratch_result(tmp_path / "result", lambda part: asked.append(part) or True)
    session.shown = session.shown._replace(result=what_if)
    assert figure(page).is_drawn
    assert not asked
    fresh.turn_to_workspace(OrbitWorkspace.WEAK_DIRECTIONS)
    spectrum = figure(page, "eigenmode-spectrum")
    assert spectrum.is_pending
    assert asked == ["eigenmodes"]
    fresh.turn_to_workspace(OrbitWorkspace.ORDERS)
    session.compare_with(session.shown._replace(result=whole, orbit=5))
    session.figure_of_both = "eigenmode-spectrum"
    both = figure(page, "both-solutions")
    assert both.is_pending

    write_eigenmodes(tmp_path / "result", tables)
    for view in (spectrum, both):
        view.draw()
        assert view.is_drawn
    assert asked == ["eigenmodes"]


def test_first_solution_that_failed_says_what_to_do(fresh):
    session = fresh.session
    head, page = HeadView(fresh).__panel__()[0], OrbitPage(fresh, wake)
    words, tabs = tables(CalibrationView(session))
    view = figure(page)
    session.job.take({"event": "failed", "message": "no reference source"})
    session.poll()
    assert view.is_due
    view.draw()
    assert (
        "There is no solution: no reference source. Change the settings on the left" in head.object
    )
    for text in (words.object, view._body[0].object):
        assert "There is no solution.<" in text
    assert not tabs.visible


def test_figure_that_cannot_be_drawn_has_no_words_or_numbers_of_the_one_before():
    def draw():
        raise ValueError("no sources")

    view = FigureView(diagnostics()[0], draw)
    view.visibility.param.update(is_near=True, room=[500, 400])
    view.draw()
    assert view._tools.summary == "This figure cannot be drawn: no sources"
    assert "tried again at the next change" in view._body[0].object
    assert view._text_tables() == []


class LostRun(FakeRun):
    """A run that is deleted while it is shown."""

    is_lost = False

    def stamp(self):
        return self.is_lost

    def orbits(self):
        if self.is_lost:
            raise InputError("runs/default: expected a run, found nothing")
        return super().orbits()

    def counts(self):
        if self.is_lost:
            raise InputError("runs/default: expected a run, found nothing")
        return super().counts()


def test_run_that_is_gone_is_said_and_what_was_read_stays(fit_result, survey):
    run = LostRun("default", survey, fit_result)
    navigation = Navigation(Session(SurveyStore(fit_result, [run])))
    page = SurveyPage(navigation, wake)
    rows = page._table._table.value
    run.is_lost = True
    page._read()
    assert "The run cannot be read: runs/default: expected a run" in page._head.object
    assert "Reload the page once the run is there again." in page._head.object
    assert "What was read before stays." in page._head.object
    assert page._below.visible
    assert page._table._table.value.equals(rows)
    run.is_lost = False
    page._read()
    assert "cannot be read" not in page._head.object


def test_run_is_read_and_judged_elsewhere(fit_result, survey):
    store, waiting = SurveyStore(fit_result, [FakeRun("default", survey, fit_result)]), Waiting()
    store.run_reader = RunReader(waiting)
    page = SurveyPage(Navigation(Session(store)), wake)
    assert page.is_pending
    page.look()
    assert "This run is being read and judged." in page._head.object
    waiting.work()
    page.look()
    assert not page.is_pending
    assert "This run" in page._head.object
    assert "being read" not in page._head.object
    assert len(page._table._table.value) == len(survey.orbits)
    # The next page has it at once.
    page = SurveyPage(Navigation(Session(store)), wake)
    assert not page.is_pending
    assert "being read" not in page._head.object


def test_page_of_a_source_says_that_its_run_is_bad(fit_result, survey):
    store, waiting = SurveyStore(fit_result, [FakeRun("default", survey, fit_result)]), Waiting()
    store.run_reader = RunReader(waiting)
    navigation = Navigation(Session(store))
    page = SourcePage(navigation, wake)
    assert not page.is_pending
    navigation.turn_to(View.SOURCE)
    assert not page.is_pending
    navigation.find_source(str(survey.motions["source_id"].iloc[0]))
    assert page.is_pending
    page.look()
    assert page._remark._pane.object == ""
    waiting.work()
    page.look()
    assert not page.is_pending
    assert "This run should not be trusted as it is" in page._remark._pane.object
    navigation.turn_to(View.SURVEY)
    assert not page.is_pending


def test_other_run_is_not_shown_with_the_verdict_on_the_one_before(fit_result, survey):
    runs = [FakeRun(name, survey, fit_result) for name in ("first", "second")]
    store, waiting = SurveyStore(fit_result, runs), Waiting()
    navigation = Navigation(Session(store))
    page = SurveyPage(navigation, wake)
    store.run_reader = RunReader(waiting)
    navigation.run_name = "second"
    assert "second" in page._head.object
    assert "being read" in page._head.object
    assert page._run_tables() == {}


def test_reasons_of_the_verdict_leave_the_room_to_figures_elsewhere(fit_result, survey):
    run = FakeRun("default", survey, fit_result)
    navigation = Navigation(Session(SurveyStore(fit_result, [run])))
    page = SurveyPage(navigation, wake)
    # This run is not good.
    assert "<details class='verdict bad' open>" in page._head.object
    navigation.turn_to_workspace(SurveyWorkspace.CATALOGUE)
    assert "<details class='verdict bad'>" in page._head.object


def test_run_that_was_gone_before_the_page_is_said_instead(fit_result, survey):
    run = LostRun("default", survey, fit_result)
    run.is_lost = True
    navigation = Navigation(Session(SurveyStore(fit_result, [run])))
    survey_page, source_page = SurveyPage(navigation, wake), SourcePage(navigation, wake)
    assert "The run cannot be read" in survey_page._head.object
    assert not survey_page._below.visible
    navigation.turn_to_workspace(SurveyWorkspace.CATALOGUE)
    assert "The run cannot be read" in survey_page._head.object
    assert "stays" not in survey_page._head.object
    assert "The run cannot be read" in source_page._head.object
