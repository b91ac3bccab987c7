"""A page that nobody touches says that its run is gone, and no more once it is there again."""

import asyncio
import shutil
from concurrent.futures import ThreadPoolExecutor

from bokeh.document import Document
from panel.io.state import set_curdoc

from plateviz.dashboard.navigation.lost_run import look_for_run
from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.ticker import PageTicker
from plateviz.dashboard.views.controls.run_selector import run_selector
from plateviz.dashboard.views.elements.notice import NoticeView
from plateviz.dashboard.views.pages.pages import Pages
from plateviz.dashboard.views.pages.source import SourcePage
from plateviz.dashboard.views.pages.survey import SurveyPage
from plateviz.runs.new_run import begin_run
from plateviz.runs.run import survey_runs
from solver.data.settings import FitSettings
from solver.errors import InputError
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore


def test_removed_run_is_said_until_it_is_there_again(fit_result, survey_folder):
    run = begin_run(survey_folder, "default", FitSettings())
    navigation = Navigation(Session(SurveyStore(fit_result, survey_runs(survey_folder))))
    notice = NoticeView(navigation.session).__panel__()
    look_for_run(navigation)
    assert len(notice) == 0
    shutil.move(run.directory, survey_folder / "elsewhere")
    navigation.session.note(["orbit: expected one of 0, 1, found 'x'"])
    look_for_run(navigation)
    lost, other = notice
    assert "The run default is not on the disk any more" in lost.object
    assert not lost.closeable
    other.closed = True
    assert [alert.object for alert in notice] == [lost.object]
    shutil.move(survey_folder / "elsewhere", run.directory)
    look_for_run(navigation)
    assert len(notice) == 0


def test_sources_of_a_removed_run_are_not_awaited(fit_result, survey_folder):
    run = begin_run(survey_folder, "default", FitSettings())
    navigation = Navigation(Session(SurveyStore(fit_result, survey_runs(survey_folder))))
    assert "No orbit of this run" in SourcePage(navigation, id)._head.object
    shutil.move(run.directory, survey_folder / "elsewhere")
    assert "the run is not on the disk any more" in SourcePage(navigation, id)._head.object


def test_run_that_was_made_again_with_other_settings_is_said(fit_result, survey_folder):
    run = begin_run(survey_folder, "default", FitSettings())
    navigation = Navigation(Session(SurveyStore(fit_result, survey_runs(survey_folder))))
    for settings, is_said in ((FitSettings(), False), (FitSettings(order=3), True)):
        shutil.rmtree(run.directory)
        begin_run(survey_folder, "default", settings)
        look_for_run(navigation)
        assert ("Another run has the name default" in navigation.session.loss) == is_said
    opened = Navigation(Session(SurveyStore(fit_result, survey_runs(survey_folder))))
    look_for_run(opened)
    assert opened.session.loss == ""


def test_page_of_files_has_no_run_to_lose(fit_result):
    navigation = Navigation(Session(SurveyStore(fit_result, [])))
    look_for_run(navigation)
    assert navigation.session.loss == ""


def test_page_that_has_ended_is_neither_looked_at_nor_woken(fit_result):
    navigation = Navigation(Session(SurveyStore(fit_result, [])))

    async def end_page():
        document, follower = Document(), id
        with set_curdoc(document):
            ticker = PageTicker(navigation, Pages(navigation, id))
        document.on_change(follower)
        document.destroy(follower)
        ticker._look_soon()
        ticker.wake()
        return ticker

    # The loop of a browser's tests may run in this one.
    with ThreadPoolExecutor(1) as thread:
        assert not thread.submit(lambda: asyncio.run(end_page())).result()._is_to_tick


def test_run_that_begins_is_offered_and_the_first_one_shown(fit_result, survey_folder):
    store = SurveyStore(fit_result, [])
    store.runs = lambda: survey_runs(survey_folder)
    navigation = Navigation(Session(store))
    page, source = SurveyPage(navigation, id), SourcePage(navigation, id)
    (selector,) = run_selector(navigation)
    assert (navigation.run, selector.visible, source._entry.disabled) == (None, False, True)
    begin_run(survey_folder, "default", FitSettings())
    look_for_run(navigation)
    assert navigation.run_name == "default"
    assert (selector.visible, selector.value, source._entry.disabled) == (True, "default", False)
    assert "of 3 orbits" in navigation.growth
    assert "0 of 3 orbits are done" in page._head.object
    shown = navigation.run
    begin_run(survey_folder, "another", FitSettings(order=4))
    look_for_run(navigation)
    assert list(selector.options) == ["another", "default"]
    # The page stays where it is, with what it has read.
    assert navigation.run is shown
    selector.value = "another"
    assert navigation.run.name == "another"


def test_source_of_one_run_is_not_shown_under_the_name_of_another(fit_result, survey):
    runs = [FakeRun(name, survey, fit_result) for name in ("damaged", "default")]
    navigation = Navigation(Session(SurveyStore(fit_result, runs)))
    navigation.run_name = "default"
    page = SourcePage(navigation, lambda *_: None)
    source = survey.history["source_id"].iloc[0]
    navigation.find_source(str(source))
    assert navigation.found is not None

    def fail():
        raise InputError("gathered.json: expected the file that was written")

    runs[0].progress = runs[0].counts = fail
    navigation.run_name = "damaged"
    assert navigation.found is None
    assert navigation.message == "gathered.json: expected the file that was written"
    assert "gathered.json" in page._head.object
    assert page._list._table.value.empty
    navigation.run_name = "default"
    assert navigation.found is not None


def test_orbit_whose_solution_is_damaged_is_the_one_that_a_fit_solves(fit_result, survey):
    class Damaged(FakeRun):
        def has_fitted(self, orbit):
            return True

        def result(self, orbit):
            if orbit == 1:
                raise InputError("orbit=0001/residuals.parquet: damaged")
            return super().result(orbit)

    run = Damaged("default", survey, fit_result)
    navigation = Navigation(Session(SurveyStore(fit_result, [run])))
    navigation.begin({"view": "orbit", "orbit": "1"})
    session = navigation.session
    assert "orbit=0001/residuals.parquet: damaged" in session.message
    assert session.shown_part.orbit == 1
    session.refit()
    assert session.store.requested[-1][0] == 1
