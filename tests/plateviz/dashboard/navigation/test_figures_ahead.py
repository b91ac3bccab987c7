"""Figures of the solution without the selection, made before a person asks for it."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from plateviz.dashboard.navigation.figures_ahead import FiguresAhead
from plateviz.dashboard.session.expected_what_ifs import ExpectedWhatIfs
from plateviz.dashboard.session.orbit_figures import chosen_of, figure_of, figures_of
from plateviz.dashboard.session.selection_actions import SelectionActions
from plateviz.plots.workspace import OrbitWorkspace
from tests.plateviz.dashboard.fake_store import finish


@pytest.fixture
def live(live, fit_result):
    """The session with three sources selected."""
    live.selection.select_sources(frozenset(fit_result.sources["source_id"].tolist()[:3]))
    return live


@pytest.fixture
def navigation(live):
    return SimpleNamespace(session=live, orbit_workspace=OrbitWorkspace.RESIDUALS)


@pytest.fixture
def timers():
    """What is to be called later."""
    return []


@pytest.fixture
def ahead(live, navigation, timers):
    return FiguresAhead(navigation, ExpectedWhatIfs(live), lambda _, call: timers.append(call))


@pytest.fixture
def following(live, fit_result):
    """The solution that the solver makes next."""
    live.store._result = replace(fit_result)
    return live.store._result


@pytest.fixture
def plotted(monkeypatch):
    """Names of the figures that are made."""
    names = []

    def note(diagnostic, chosen, make=figure_of):
        names.append(diagnostic.name)
        return make(diagnostic, chosen)

    monkeypatch.setattr("plateviz.dashboard.navigation.figures_ahead.figure_of", note)
    return names


def wait(timers):
    """Let all that waits be called, once."""
    waiting, timers[:] = timers[:], []
    for call in waiting:
        call()


@pytest.fixture(autouse=True)
def _quick(monkeypatch):
    monkeypatch.setattr("plateviz.dashboard.navigation.figures_ahead._LOOK_SECONDS", 0.0)


def test_they_are_made_once_the_solver_has_made_the_solution(live, ahead, timers, plotted):
    ahead.begin()
    wait(timers)
    assert plotted == []
    live.store._has_result = True
    wait(timers)
    assert len(plotted) > 2
    assert timers == []


def test_a_click_finds_them(live, navigation, ahead, timers, following, plotted):
    live.store._has_result = True
    ahead.begin()
    wait(timers)
    SelectionActions(live).leave_out()
    finish(live)
    assert live.shown.result is following
    chosen, made = chosen_of(live), dict(following.derived["figures"])
    assert chosen is not None
    for one in figures_of(live, navigation.orbit_workspace):
        if one.name in plotted:
            key = one.name, chosen.exposures, chosen.detector
            assert figure_of(one, chosen) is made[key].figure


def test_nothing_is_made_without_a_selection(live, ahead, timers, plotted):
    live.store._has_result = True
    live.selection.select_sources(frozenset())
    ahead.begin()
    wait(timers)
    assert plotted == []
    assert timers == []


def test_it_looks_no_longer_for_what_does_not_come(ahead, timers):
    ahead.begin()
    for _ in range(100):
        wait(timers)
    assert timers == []
