"""The report of what is on the screen: its title, settings and name."""

import threading

import pytest

from plateviz.dashboard.navigation.navigation import Navigation, View
from plateviz.dashboard.saving.page_report import page_report
from plateviz.dashboard.session.session import Session
from plateviz.plots.workspace import OrbitWorkspace, SurveyWorkspace
from solver.errors import InputError
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore

pytestmark = pytest.mark.usefixtures("few_figures")


@pytest.fixture
def navigation(fit_result, survey):
    run = FakeRun("default", survey, fit_result)
    run.header = lambda: {"settings": {"order": 5}, "versions": {"plateviz": "1"}}
    made = Navigation(Session(SurveyStore(fit_result, [run])))
    made.turn_to(View.ORBIT)
    return made


def made(later):
    """Make a report on a thread, as the page does; return its file's name and text."""
    found, steps = [], []
    work = threading.Thread(
        target=lambda: found.append(later.make(lambda *step: steps.append(step)))
    )
    work.start()
    work.join()
    assert steps[-1][0] == steps[-1][1] == len(steps)
    return found[0].name, found[0].content.decode()


def test_report_of_a_solution_has_its_settings_and_its_command(navigation, fit_result):
    name, page = made(page_report(navigation))
    assert name == "orbit-0-report.html"
    assert f"<title>Orbit {fit_result.orbit_id} " in page
    assert "plateviz survey sky --run reproduced --orbits 0" in page
    assert "order 5" in page


def test_reports_of_all_pages_are_made_in_turn(navigation):
    turns = navigation.session.store.reports
    for view in (View.ORBIT, View.SURVEY):
        navigation.turn_to(view)
        assert page_report(navigation).turns is turns


def test_report_of_a_what_if_is_named_and_compared(navigation):
    session = navigation.session
    fitted = session.shown
    settings = fitted.settings.with_(order=3)
    what_if = fitted._replace(
        settings=settings, is_replaceable=True, result=session.store.result(0, settings)
    )
    session.param.update(shown=what_if, other=fitted)
    later = page_report(navigation)
    # What is on the screen when the button is pressed is reported, not what follows.
    session.param.update(shown=fitted, other=None)
    name, page = made(later)
    assert name == "orbit-0-what-if-report.html"
    assert "what if: order 3; compared with order 5" in page
    assert "--order 3" in page


def test_report_has_the_name_that_a_person_has_given_the_solution(navigation):
    session = navigation.session
    session.param.update(shown=session.shown._replace(run=""))
    session.journal.add(session.shown)
    session.journal.rename(session.journal.made[0], "<b>mine")
    _, page = made(page_report(navigation))
    assert "&lt;b&gt;mine: order 5" in page
    assert "<b>mine" not in page


def test_report_has_what_explore_draws_while_it_is_on_the_screen(navigation):
    drawn = navigation.exploration
    drawn.table = "sources"
    drawn.offer(["n_obs", "sigma_ra_marginal"])
    _, page = made(page_report(navigation))
    assert "sigma_ra_marginal against n_obs" not in page
    navigation.turn_to_workspace(OrbitWorkspace.EXPLORE)
    _, page = made(page_report(navigation))
    assert "sigma_ra_marginal against n_obs" in page


def test_report_has_the_figure_of_both_solutions_while_it_is_on_the_screen(navigation):
    session = navigation.session
    settings = session.shown.settings.with_(order=3)
    other = session.shown._replace(settings=settings, result=session.store.result(0, settings))
    session.param.update(other=other)
    _, before = made(page_report(navigation))
    navigation.turn_to_workspace(OrbitWorkspace.ORDERS)
    _, page = made(page_report(navigation))
    assert f"both-{session.figure_of_both}" in page
    assert f"both-{session.figure_of_both}" not in before


def test_report_of_a_source_is_that_of_its_run(navigation, survey):
    source = int(survey.history["source_id"].iloc[0])
    navigation.open_source(str(source))
    name, page = made(page_report(navigation))
    assert name == f"source-{source}-report.html"
    assert f"plateviz report sky --run default --source {source} -o REPORT.html" in page


def test_view_that_shows_nothing_is_refused(navigation, fit_result):
    navigation.turn_to(View.SOURCE)
    with pytest.raises(InputError, match="no source is shown yet"):
        page_report(navigation)
    empty = Navigation(Session(SurveyStore(fit_result, [])))
    with pytest.raises(InputError, match="no solution is shown yet"):
        page_report(empty)
    empty.turn_to(View.SURVEY)
    with pytest.raises(InputError, match="`plateviz survey sky` fits all its orbits"):
        page_report(empty)


def test_report_of_a_run_is_made_of_its_tables(navigation, survey, monkeypatch):
    seen = []
    monkeypatch.setattr(
        "plateviz.dashboard.saving.page_report.survey_report",
        lambda run, facts, *_: seen.append((run.name, facts["Report"]["Command"])) or 1 / 0,
    )
    navigation.turn_to(View.SURVEY)
    with pytest.raises(ZeroDivisionError):
        page_report(navigation).make(print)
    assert seen == [("default", "plateviz report sky --run default --survey -o REPORT.html")]


def test_report_compares_the_runs_that_are_on_the_screen(navigation, survey, monkeypatch):
    seen = []
    monkeypatch.setattr(
        "plateviz.dashboard.saving.page_report.survey_report",
        lambda run, facts, other, more: seen.append((other and other.name, more.both)) or 1 / 0,
    )
    other = FakeRun("low", survey, navigation.session.shown.result)
    store = SurveyStore(navigation.session.shown.result, [navigation.run, other])
    navigation = Navigation(Session(store))
    navigation.turn_to(View.SURVEY)
    for workspace in (SurveyWorkspace.COMPARE, SurveyWorkspace.VERDICT):
        navigation.turn_to_workspace(workspace)
        with pytest.raises(ZeroDivisionError):
            page_report(navigation).make(print)
    assert seen == [("low", ["orbit-health"]), (None, ())]
