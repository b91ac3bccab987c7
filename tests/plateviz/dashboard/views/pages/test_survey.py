"""The Survey page: how its figures are laid out."""

from plateviz.dashboard.navigation.navigation import Navigation, View
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.cards.workspace import below_lines
from plateviz.dashboard.views.pages.survey import SurveyPage
from plateviz.plots.workspace import SurveyWorkspace
from tests.plateviz.dashboard.card_places import takes_row
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore


def test_figures_of_many_frames_have_a_row_each(fit_result, survey):
    store = SurveyStore(fit_result, [FakeRun("default", survey, fit_result)])
    navigation = Navigation(Session(store))
    page = SurveyPage(navigation, lambda *_: None)
    navigation.turn_to(View.SURVEY)
    navigation.turn_to_workspace(SurveyWorkspace.ACCURACY)
    views = page.figures._views
    rows = [one.card_name for one in views if takes_row(one)]
    assert rows == ["motion-pulls", "calibration-trends"]
    # The others fill rows of two.
    assert (len(views) - len(rows)) % 2 == 0


def test_workspaces_leave_room_for_the_line_that_says_how_far_a_run_is(fit_result, survey):
    store = SurveyStore(fit_result, [FakeRun("default", survey, fit_result)])
    navigation = Navigation(Session(store))
    page = SurveyPage(navigation, lambda *_: None)
    navigation.turn_to(View.SURVEY)
    for growth, lines in (("3 of 4 orbits are done.", 1), ("", 0)):
        navigation.growth = growth
        assert page._below.styles == below_lines(lines)
