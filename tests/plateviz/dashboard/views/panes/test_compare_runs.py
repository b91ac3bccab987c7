"""The workspace of two runs: what it reads, draws and says, and how they are exchanged."""

import json

import pytest

from plateviz.dashboard.navigation.keys import press
from plateviz.dashboard.navigation.lost_run import look_for_run
from plateviz.dashboard.navigation.navigation import Navigation, View
from plateviz.dashboard.navigation.saved_view import open_view, view_text
from plateviz.dashboard.saving.page_code import page_code
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.browser.address_bar import AddressBar
from plateviz.dashboard.views.pages.survey import SurveyPage
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.solving import run_reader
from plateviz.solving.run_reader import RunReader
from plateviz.tables.survey_tables import SurveyTables
from solver.data.settings import FitSettings
from solver.errors import InputError
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore
from tests.plateviz.solving.waiting import Waiting

CARDS = ["both-runs", "motion-differences"]


class ComparedRun(FakeRun):
    """A run that may be removed, and that counts how often it is read."""

    is_lost, n_read = False, 0

    def is_there(self):
        return not self.is_lost

    def is_replaced(self):
        return False

    def orbits(self):
        self.n_read += 1
        return super().orbits()

    def motions(self):
        found = super().motions()
        return found if self.is_gathered else found.head(0)

    def stamp(self):
        if self.is_lost:
            raise InputError(f"runs/{self.name}: expected a run, found nothing")
        return self.progress()


@pytest.fixture
def runs(survey, fit_result):
    return [
        ComparedRun("default", survey, fit_result),
        ComparedRun("low", survey, fit_result, FitSettings(order=3)),
    ]


@pytest.fixture
def navigation(fit_result, runs, survey, monkeypatch):
    def read(run, tables):
        return SurveyTables(
            tables.orbits, tables.motions, survey.catalogue, survey.truth, tests=tables.tests
        )

    monkeypatch.setattr(run_reader, "survey_tables", read)
    return Navigation(Session(SurveyStore(fit_result, runs)))


@pytest.fixture
def page(navigation):
    made = SurveyPage(navigation, lambda *_: None)
    navigation.turn_to_workspace(SurveyWorkspace.COMPARE)
    return made


def words(page):
    return page._compare._table.object


def drawn(page):
    """The cards, as large as on a screen and drawn."""
    for view in page.figures._views:
        view.visibility.param.update(is_near=True, room=[900, 420])
    page.figures.draw_due()
    return page.figures._views


def titles(view):
    return [frame.title for frame in view._figure]


def test_survey_with_one_run_says_how_to_make_another(navigation, runs):
    navigation.session.store._runs = runs[:1]
    navigation = Navigation(Session(navigation.session.store))
    page = SurveyPage(navigation, lambda *_: None)
    navigation.turn_to_workspace(SurveyWorkspace.COMPARE)
    alone, cards = page._stack._made[SurveyWorkspace.COMPARE]
    assert "has one run, default" in alone.object
    assert "<code>plateviz survey sky --run other --order 3</code>" in alone.object
    assert (alone.visible, cards.visible) == (True, False)
    assert "other" not in navigation.address()
    press(navigation, "b")
    assert navigation.run_name == "default"
    assert "compared_with" not in page_code(navigation).python

    # Somebody makes it while the page is open.
    navigation.session.store._runs = runs
    look_for_run(navigation)
    assert (alone.visible, cards.visible) == (False, True)
    assert page._compare._run.options == ["low"]
    assert "order 3" in words(page)


def test_other_run_is_read_once_the_workspace_is_on_the_screen(navigation, runs):
    default, low = runs
    SurveyPage(navigation, lambda *_: None)
    assert (default.n_read, low.n_read) == (1, 0)
    navigation.turn_to_workspace(SurveyWorkspace.COMPARE)
    navigation.turn_to_workspace(SurveyWorkspace.VERDICT)
    navigation.turn_to_workspace(SurveyWorkspace.COMPARE)
    assert (default.n_read, low.n_read) == (1, 1)


def test_what_differs_is_a_table_that_can_be_saved(page):
    assert "Distortion order" in words(page)
    assert page.figures.cards == CARDS
    (table,) = page._compare._files().values()
    assert table.colnames == ["what", "a", "b", "change"]
    assert list(table["what"][:2]) == ["Run", "Distortion order"]
    assert page._compare._subject() == "run-default-against-low"
    assert page._compare._save.visible


def test_figures_are_of_both_runs_and_follow_in_place(navigation, page):
    both, differences = drawn(page)
    assert [title[:3] for title in titles(both)] == ["(A)", "(A)", "(B)", "(B)"]
    assert titles(differences)[0] == "Parallax: rms 0 σ"
    models = [view._drawn for view in (both, differences)]
    navigation.session.run_comparison.figure = "orbit-counts"
    assert (both.is_due, page._compare._figure.value) == (True, "orbit-counts")
    drawn(page)
    assert "Orbits of each source" in titles(both)[0]
    assert [view._drawn for view in (both, differences)] == models
    # Nothing has changed.
    navigation.turn_to_workspace(SurveyWorkspace.VERDICT)
    navigation.turn_to_workspace(SurveyWorkspace.COMPARE)
    assert [view.is_due for view in (both, differences)] == [False, False]


def test_b_exchanges_the_two_runs_and_back(navigation, page, runs):
    def cells():
        (table,) = page._compare._files().values()
        return [tuple(row) for row in table[["what", "a", "b"]]]

    before = cells()
    press(navigation, "b")
    assert (navigation.run_name, page._compare._run.value) == ("low", "default")
    assert [(what, b, a) for what, a, b in before] == cells()
    assert navigation.address()["other"] == "default"
    assert "(B) Run:</span> <b>low</b>" in page._head.object
    press(navigation, "b")
    assert (navigation.run_name, cells()) == ("default", before)
    # Each was read once.
    assert [run.n_read for run in runs] == [1, 1]


def test_b_keeps_the_pair_among_three_runs(navigation, page, survey, fit_result, runs):
    runs.append(ComparedRun("third", survey, fit_result))
    look_for_run(navigation)
    page._compare._run.value = "third"
    for expected in ("third", "default"):
        press(navigation, "b")
        assert navigation.run_name == expected
    assert page._compare._run.value == "third"
    # Of the three, the one on the screen is not offered.
    assert page._compare._run.options == ["low", "third"]
    # Another run on the screen, which was the other one, leaves the first of the rest.
    navigation.run_name = "third"
    assert page._compare._run.value == "default"


def test_address_and_saved_view_carry_the_other_run_and_the_figure(
    navigation, page, survey, fit_result, runs
):
    runs.append(ComparedRun("third", survey, fit_result))
    look_for_run(navigation)
    bar = AddressBar(navigation)
    page._compare._run.value = "third"
    page._compare._figure.value = "motion-pulls"
    assert bar.query.endswith("&run=default&other=third&figure=motion-pulls")
    for opens in (
        lambda one: one.begin(navigation.address()),
        lambda one: open_view(one, view_text(navigation)),
    ):
        opened = Navigation(Session(navigation.session.store))
        opens(opened)
        assert opened.address() == navigation.address()
        assert opened.session.notice == ""
    navigation.turn_to_workspace(SurveyWorkspace.VERDICT)
    assert not {"other", "figure"} & set(navigation.address())


@pytest.mark.parametrize(
    ("part", "value", "expected"),
    [
        ("other", "gone", "other: expected low, found 'gone'"),
        ("other", "default", "other: expected low, found 'default'"),
        ("figure", "sky-distribution", "figure: expected orbit-health, "),
    ],
)
def test_invalid_part_of_an_address_is_told_and_changes_nothing(navigation, part, value, expected):
    address = {"view": "survey", "workspace": "compare-runs", "run": "default"}
    navigation.begin(address | {part: value})
    assert expected in navigation.session.notice
    assert navigation.address()["other"] == "low"
    assert navigation.address()["figure"] == "orbit-health"


def test_view_whose_other_run_is_gone_is_told(navigation, page):
    text = json.loads(view_text(navigation))
    text["address"]["other"] = "gone"
    open_view(navigation, json.dumps(text))
    assert "other: expected low, found 'gone'" in navigation.session.notice
    assert navigation.view is View.SURVEY


def test_other_run_that_is_removed_is_told_and_not_exchanged(navigation, page, runs):
    both, _ = drawn(page)
    runs[1].is_lost = True
    look_for_run(navigation)
    assert "The runs cannot be compared: runs/low: expected a run" in words(page)
    assert not page._compare._save.visible
    drawn(page)
    assert "No other run has been read." in both._body[0].object
    press(navigation, "b")
    assert navigation.run_name == "default"
    runs[1].is_lost = False
    look_for_run(navigation)
    assert "Distortion order" in words(page)
    drawn(page)
    assert titles(both)[0].startswith("(A)")


def test_run_that_is_being_fitted_has_its_orbits_and_says_so(navigation, page, runs):
    runs[1].is_gathered = False
    runs[1].n_fitted = 1
    look_for_run(navigation)
    assert "Run low has 87 of 90 orbits so far; its motions are fitted after" in words(page)
    assert "Orbits fitted" in words(page)
    _, differences = drawn(page)
    assert "after the last orbit" in differences._figure.message
    runs[1].is_gathered = True
    look_for_run(navigation)
    assert "so far" not in words(page)


def test_settings_that_cannot_be_read_are_told(navigation, page, runs):
    def header():
        raise InputError("run.toml: expected a file, found another one")

    runs[1].header = header
    navigation.session.run_comparison.state = "written since"
    page._compare._compared = None
    page._compare._fill()
    assert "The runs cannot be compared: run.toml" in words(page)


def test_other_run_is_read_elsewhere(fit_result, navigation, runs):
    waiting = Waiting()
    page = SurveyPage(navigation, lambda *_: None)
    navigation.session.store.run_reader = RunReader(waiting)
    navigation.turn_to_workspace(SurveyWorkspace.COMPARE)
    assert page.is_pending
    assert "The other run is being read." in words(page)
    both, _ = drawn(page)
    assert both.is_pending
    waiting.work()
    page.look()
    assert not page.is_pending
    assert "Distortion order" in words(page)
    drawn(page)
    assert both.is_drawn


def test_command_and_python_compare_both_runs(navigation, page):
    code = page_code(navigation)
    opened = "survey = plateviz.open('sky', run='default').compared_with('low')\n"
    assert opened in code.python
    assert "survey.figure('orbit-health', both=True)" in code.python
    assert "survey.figure('motion-differences')" in code.python
    report = "plateviz report sky --run default --survey --other low --both orbit-health"
    assert code.command.startswith(report)


def test_runs_of_different_catalogues_are_not_compared(navigation, page, runs):
    runs[0].header, runs[1].header = (
        lambda name=name: {**ComparedRun.header(runs[0]), "inputs": {"reference.parquet": name}}
        for name in ("a", "b")
    )
    navigation.session.run_comparison.state = "written since"
    assert "The runs cannot be compared: runs" in words(page)
    assert "found that reference.parquet has changed between them" in words(page)
    assert not page._compare._save.visible
