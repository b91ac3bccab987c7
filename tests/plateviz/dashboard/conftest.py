"""A page over a survey with a run, without a browser or a solver."""

import pytest

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.session import Session
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore


@pytest.fixture
def run(survey, fit_result):
    return FakeRun("default", survey, fit_result)


@pytest.fixture
def navigation(fit_result, run):
    return Navigation(Session(SurveyStore(fit_result, [run])))
