"""A page over a survey with a run, without a browser or a solver."""

import pytest

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.session import Session
from tests.plateviz.dashboard.fake_store import FakeStore, finish
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore


@pytest.fixture
def live(fit_result):
    """A session with a solution on the screen, which shows a what-if at every change."""
    made = Session(FakeStore(fit_result))
    made.show_orbit(0)
    finish(made)
    return made


@pytest.fixture
def run(survey, fit_result):
    return FakeRun("default", survey, fit_result)


@pytest.fixture
def navigation(fit_result, run):
    return Navigation(Session(SurveyStore(fit_result, [run])))
