"""Navigation: the view, run and source on the screen, without a browser."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from plateviz.dashboard.navigation.keys import press
from plateviz.dashboard.navigation.navigation import Navigation, View
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.stage import Stage
from plateviz.dashboard.views.controls.shown_part import ShownPartView
from plateviz.plots.workspace import OrbitWorkspace, SurveyWorkspace
from plateviz.solving.origin import OrbitFiles, SurveyFolder
from plateviz.solving.solution_store import SolutionStore
from solver.data.settings import FitSettings
from solver.errors import InputError
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore


def requested(navigation):
    return [(orbit, settings) for orbit, settings, _ in navigation.session.store.requested]


def test_survey_with_a_run_opens_the_survey_view(navigation, run):
    navigation.begin({})
    assert (navigation.view, navigation.run) == (View.SURVEY, run)
    assert requested(navigation) == []


@pytest.mark.parametrize(
    ("origin", "text"),
    [(SurveyFolder("sky"), "`plateviz survey sky`"), (OrbitFiles("o", "r"), "one orbit")],
    ids=["survey", "files"],
)
def test_origin_without_a_run_opens_the_orbit_view_with_a_hint(fit_result, origin, text):
    store = SurveyStore(fit_result, [])
    store.origin = origin
    navigation = Navigation(Session(store))
    navigation.begin({"view": "orbit"})
    assert (navigation.view, navigation.run) == (View.ORBIT, None)
    assert text in navigation.why_no_run
    assert requested(navigation) == [(0, FitSettings())]


def test_complete_run_is_preferred(fit_result, survey):
    runs = [FakeRun("a", survey, fit_result, is_complete=False), FakeRun("b", survey, fit_result)]
    assert Navigation(Session(SurveyStore(fit_result, runs))).run is runs[1]


def test_fitted_orbit_is_read_from_the_run(navigation, run):
    navigation.open_orbit(0)
    session = navigation.session
    assert (navigation.view, session.stage) == (View.ORBIT, Stage.READY)
    assert (session.shown.orbit, session.shown.result) == (0, run.result(0))
    assert session.solutions == [session.shown]
    assert requested(navigation) == []


def test_orbit_that_is_not_in_the_run_is_fitted(navigation):
    navigation.open_orbit(1)
    assert requested(navigation) == [(1, FitSettings())]


def test_orbit_view_requests_its_orbit_once(navigation, run):
    navigation.turn_to(View.ORBIT)
    navigation.turn_to(View.SURVEY)
    navigation.turn_to(View.ORBIT)
    assert run.read == [0]
    assert requested(navigation) == []


def test_selected_orbit_has_the_settings_on_the_screen(navigation):
    session = navigation.session
    navigation.open_orbit(0)
    session.choices.what_if_at_once = False
    session.choices.order = 3
    session.refit()
    session.job.take({"event": "done"})
    session.poll()
    navigation.choose_orbit(0)
    assert requested(navigation)[-1] == (0, FitSettings(order=3))


def test_orbit_of_a_run_sets_the_controls_to_its_settings(fit_result, survey):
    run = FakeRun("third", survey, fit_result, FitSettings(order=3))
    navigation = Navigation(Session(SurveyStore(fit_result, [run])))
    navigation.open_orbit(0)
    assert navigation.session.choices.order == 3
    assert navigation.session.job is None


def test_opening_an_orbit_again_keeps_its_solutions(navigation):
    navigation.open_orbit(0)
    shown = navigation.session.shown
    navigation.open_orbit(0)
    assert navigation.session.shown is shown


def test_opening_an_orbit_cancels_the_fit_of_another(navigation):
    navigation.open_orbit(1)
    job = navigation.session.job
    navigation.open_orbit(0)
    assert navigation.session.store.cancelled == [job]
    assert (navigation.session.job, navigation.session.shown_part.orbit) == (None, 0)


def test_run_that_cannot_be_read_is_reported(navigation, run):
    def fail(orbit):
        raise InputError("orbit=0000: expected a complete run")

    run.result = fail
    navigation.open_orbit(0)
    assert navigation.session.stage is Stage.FAILED
    assert navigation.session.message == "orbit=0000: expected a complete run"
    assert requested(navigation) == []


def test_source_is_found_by_its_id(navigation, survey):
    history, motion = survey.source("reference")
    navigation.open_source(f" {motion['source_id']} ")
    found = navigation.found
    assert (navigation.view, navigation.message) == (View.SOURCE, "")
    assert found.source_id == motion["source_id"]
    assert len(found.history) == len(history)
    assert found.motion["n_orbits"] == motion["n_orbits"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("17", "Run 'default' has no source 17."),
        ("Vega", "Expected the id of a source, a whole number, found 'Vega'."),
        ("99999999999999999999", "a whole number"),
        ("9999999999999999999", "a whole number"),
        ("1e3", "a whole number"),
    ],
    ids=["unknown", "name", "too-long", "too-large", "float"],
)
def test_source_that_is_not_found_is_reported(navigation, text, message):
    navigation.find_source(text)
    assert navigation.found is None
    assert message in navigation.message


def test_empty_search_has_no_message(navigation):
    navigation.find_source("Vega")
    navigation.find_source("")
    assert (navigation.found, navigation.message) == (None, "")


def test_another_run_is_searched_for_the_same_source(fit_result, survey):
    empty = SimpleNamespace(history=survey.history.iloc[:0], motions=survey.motions.iloc[:0])
    runs = [FakeRun("full", survey, fit_result), FakeRun("thin", empty, fit_result)]
    navigation = Navigation(Session(SurveyStore(fit_result, runs)))
    navigation.find_source(str(survey.motions["source_id"].iloc[0]))
    assert navigation.found is not None
    navigation.run_name = "thin"
    assert navigation.found is None
    assert navigation.message.startswith("Run 'thin' has no source")


def test_address_restores_the_view_the_run_and_the_source(fit_result, survey):
    runs = [FakeRun("a", survey, fit_result), FakeRun("b", survey, fit_result)]
    first, second = (Navigation(Session(SurveyStore(fit_result, runs))) for _ in range(2))
    first.run_name = "b"
    first.open_orbit(0)
    first.open_source(str(survey.motions["source_id"].iloc[3]))
    second.begin(first.address())
    assert (second.view, second.run_name) == (View.SOURCE, "b")
    assert second.found.source_id == first.found.source_id
    assert second.session.shown_part.orbit == 0


def test_address_with_a_selection_only_opens_the_orbit_view(navigation):
    navigation.begin({"orbit": "0", "field": "1"})
    assert (navigation.view, navigation.session.shown.orbit) == (View.ORBIT, 0)


def test_each_view_keeps_its_workspace_and_the_address_has_that_on_the_screen(navigation):
    navigation.turn_to(View.ORBIT)
    navigation.turn_to_workspace(OrbitWorkspace.SKY)
    navigation.turn_to(View.SURVEY)
    assert navigation.address()["workspace"] == "verdict"
    navigation.turn_to(View.ORBIT)
    assert navigation.address()["workspace"] == "sky"
    assert navigation.workspaces_of_view == list(OrbitWorkspace)


def test_address_restores_the_workspace(navigation):
    navigation.begin({"view": "orbit", "workspace": "weak-directions"})
    assert navigation.workspace is OrbitWorkspace.WEAK_DIRECTIONS


def test_invalid_address_is_reported_in_one_notice_and_shows_the_rest(navigation):
    wrong = {"view": "moon", "workspace": "sky", "run": "../../etc", "source": "\x00", "who": "me"}
    navigation.begin(wrong)
    notice = navigation.session.notice
    told = "unknown parts, as of another version: 'who'; run: expected default,"
    assert notice.startswith(f"Not all that was asked for can be shown: {told}")
    assert "view: expected survey, orbit, source, found 'moon'" in notice
    known = "verdict, accuracy, catalogue, compare-runs, explore"
    assert f"workspace: expected {known}, found 'sky'" in notice
    assert (navigation.view, navigation.run_name) == (View.SURVEY, "default")
    assert navigation.workspace is SurveyWorkspace.VERDICT
    assert navigation.found is None


def test_files_and_a_survey_that_was_not_fitted_have_no_runs(tmp_path, made_survey):
    runs = {
        origin: SolutionStore.runs(SimpleNamespace(origin=origin, _of_runs=None))
        for origin in (OrbitFiles("o.fits", "r.fits"), SurveyFolder(str(Path(made_survey))))
    }
    assert list(runs.values()) == [[], []]


def test_next_orbit_of_the_run_is_expected_once(navigation, run):
    navigation.expect_orbit()
    assert run.expected == []
    navigation.begin({"view": "orbit", "orbit": "0"})
    navigation.expect_orbit()
    navigation.expect_orbit()
    assert run.expected == [1]


def test_run_that_is_still_being_fitted_begins_with_the_orbit(survey, fit_result):
    begun = FakeRun("default", survey, fit_result, is_complete=False)
    navigation = Navigation(Session(SurveyStore(fit_result, [begun])))
    assert (navigation.view, navigation.run_name) == (View.ORBIT, "default")


def test_source_of_a_damaged_run_is_reported(navigation, run):
    def fail(source_id):
        raise InputError("history.parquet: expected the file that was written")

    run.history = fail
    navigation.begin({"source": "17"})
    assert navigation.found is None
    assert navigation.message == "history.parquet: expected the file that was written"


def test_what_is_added_to_a_run_is_seen_at_the_next_look(fit_result, survey):
    run = FakeRun("default", survey, fit_result, is_complete=False)
    navigation = Navigation(Session(SurveyStore(fit_result, [run])))
    changed = []
    navigation.param.watch(lambda event: changed.append(event.new), "run_progress")
    assert navigation.growth.startswith("1 of 2 orbits are done")
    assert navigation.look_again()
    assert changed == []
    run.n_fitted, run.is_complete, run.is_gathered = 2, True, True
    assert not navigation.look_again()
    assert changed == [run.progress()]
    assert navigation.growth == ""


def test_orbit_that_is_added_to_the_survey_is_offered(fit_result, survey):
    run = FakeRun("watched", survey, fit_result, is_complete=False)
    run.is_gathered, run.n_fitted, run.also_written = True, 2, {"grows": True}
    store = SurveyStore(fit_result, [run])
    navigation = Navigation(Session(store))
    part = navigation.session.shown_part
    control = ShownPartView(navigation).__panel__()[0]
    assert navigation.look_again()
    assert list(control.options) == [0, 1]
    store.orbits = (0, 1, 2)
    run.also_written["n_orbits"] = 3
    assert navigation.look_again()
    assert list(part.param["orbit"].objects) == list(control.options) == [0, 1, 2]
    control.value = 2
    assert part.orbit == 2
    navigation.turn_to(View.ORBIT)
    press(navigation, "[")
    assert (part.orbit, control.value) == (1, 1)


def test_tables_that_are_written_again_are_read_again(fit_result, survey):
    run = FakeRun("watched", survey, fit_result, is_complete=False)
    run.is_gathered, run.also_written = True, {"grows": True, "gathered": (0,)}
    navigation, seen = Navigation(Session(SurveyStore(fit_result, [run]))), []
    navigation.param.watch(seen.append, "run_progress")
    navigation.look_again()
    assert seen == []
    run.also_written["gathered"] = (0, 1)
    navigation.look_again()
    assert len(seen) == 1


def end_job(navigation):
    navigation.session.job.take({"event": "done"})
    navigation.session.poll()


def again(navigation):
    """Another page that was opened by the address of a page."""
    other = Navigation(Session(navigation.session.store))
    other.begin(navigation.address())
    return other


def test_address_of_the_solution_of_the_run_has_no_settings(navigation):
    navigation.open_orbit(0)
    assert "solution" not in navigation.address()
    assert again(navigation).session.shown.run == "default"


def test_address_of_files_with_the_papers_settings_has_none(fit_result):
    navigation = Navigation(Session(SurveyStore(fit_result, [])))
    navigation.begin({})
    end_job(navigation)
    assert "solution" not in navigation.address()


def test_address_has_the_settings_of_a_fit_and_of_the_solution_before_it(navigation):
    navigation.open_orbit(0)
    session = navigation.session
    session.choices.what_if_at_once = False
    session.choices.param.update(order=3, exclusions="detector=1", aberration=False)
    session.refit()
    end_job(navigation)
    address = navigation.address()
    assert address["solution"] == "order=3 no-aberration exclude=detector=1"
    assert address["against"] == "run=default"
    opened = again(navigation)
    assert opened.session.shown.run == "default"
    # While it is fitted, the address is that of what is to come.
    assert opened.address() == address
    end_job(opened)
    assert opened.session.shown.settings == session.shown.settings
    assert opened.session.other.run == "default"
    assert opened.session.choices.settings() == session.shown.settings
    assert opened.address() == address
    assert len(opened.session.store.requested) == 2


def test_address_of_a_what_if_shows_a_what_if_of_the_same_solution(navigation):
    navigation.open_orbit(0)
    navigation.session.choices.order = 4
    end_job(navigation)
    address = navigation.address()
    assert address["solution"] == "order=4 what-if"
    opened = again(navigation)
    end_job(opened)
    shown = opened.session.shown
    assert (shown.is_replaceable, shown.settings.order) == (True, 4)
    assert opened.address() == address
    opened.session.choices.order = 5
    assert opened.session.shown.run == "default"


def test_address_of_a_listed_what_if_still_says_so(navigation):
    navigation.open_orbit(0)
    navigation.session.choices.order = 4
    end_job(navigation)
    navigation.session.list_what_if()
    assert navigation.address()["solution"] == "order=4 what-if"


def test_settings_of_the_run_are_read_from_it(fit_result, survey):
    run = FakeRun("third", survey, fit_result, FitSettings(order=3))
    navigation = Navigation(Session(SurveyStore(fit_result, [run])))
    navigation.begin({"orbit": "0", "solution": "order=3"})
    assert (navigation.session.shown.run, requested(navigation)) == ("third", [])


def test_orbit_that_the_run_lacks_is_fitted_with_its_settings(fit_result, survey):
    run = FakeRun("third", survey, fit_result, FitSettings(order=3))
    navigation = Navigation(Session(SurveyStore(fit_result, [run])))
    navigation.begin({"orbit": "1"})
    assert requested(navigation) == [(1, FitSettings(order=3))]


def test_address_compares_with_another_run_and_another_orbit(fit_result, survey):
    runs = [FakeRun("a", survey, fit_result), FakeRun("b", survey, fit_result)]
    navigation = Navigation(Session(SurveyStore(fit_result, runs)))
    navigation.begin({"orbit": "0", "run": "a", "against": "run=b"})
    assert (navigation.session.shown.run, navigation.session.other.run) == ("a", "b")
    assert navigation.address()["against"] == "run=b"


@pytest.mark.parametrize(
    ("part", "text", "told"),
    [
        ("solution", "order=12", "solution: expected a distortion order from 0 to 9, found 12"),
        ("solution", "spline=3", "solution: expected settings of a fit such as order=3, found"),
        ("solution", "too-long", "solution: the settings were too many for the address"),
        (
            "solution",
            "x" * 500_000,
            "solution: expected 400,000 characters or fewer, found 500,000",
        ),
        ("solution", "run=gone", "solution: expected a run that has orbit 0, found 'gone'"),
        ("against", "run=default orbit=1", "against: expected a run that has orbit 1, found 'def"),
        ("orbit", "77", "orbit: expected one of 0, 1, found '77'"),
    ],
    ids=["value", "setting", "long", "longer", "run", "orbit-of-run", "orbit"],
)
def test_solution_that_is_not_there_is_told_and_the_default_is_shown(navigation, part, text, told):
    navigation.begin({"view": "orbit", part: text})
    assert told in navigation.session.notice
    assert navigation.session.shown.run == "default"
    assert requested(navigation) == []
    navigation.begin({"view": "orbit"})
    assert navigation.session.notice == ""


def test_going_back_restores_what_was_on_the_screen(navigation):
    navigation.open_orbit(0)
    navigation.session.shown_part.detector = "2"
    navigation.turn_to_workspace(OrbitWorkspace.SKY)
    before, shown = navigation.address(), navigation.session.shown
    navigation.session.shown_part.detector = "3"
    navigation.choose_orbit(1)
    end_job(navigation)
    navigation.turn_to(View.SURVEY)
    after = navigation.address()
    navigation.begin(before)
    assert navigation.address() == before
    assert navigation.session.shown.equals(shown)
    navigation.begin(after)
    end_job(navigation)
    assert navigation.address() == after
    assert navigation.session.notice == ""


def test_going_back_within_an_orbit_leaves_its_solution_and_a_fit(navigation):
    navigation.open_orbit(0)
    before, shown = navigation.address(), navigation.session.shown
    navigation.turn_to_workspace(OrbitWorkspace.SKY)
    navigation.session.refit()
    job = navigation.session.job
    navigation.begin(before)
    assert navigation.session.shown is shown
    assert navigation.session.job is job
