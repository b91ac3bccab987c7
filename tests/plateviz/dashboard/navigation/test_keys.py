"""Keys: what each does to the page, without a browser."""

import pytest

from plateviz.dashboard.navigation.keys import DIGITS, KEYS, press
from plateviz.dashboard.navigation.navigation import View
from plateviz.dashboard.session.shown_part import ALL
from solver.data.settings import FitSettings
from tests.plateviz.dashboard.navigation.test_navigation import requested


@pytest.fixture
def orbit(navigation):
    """A page with the first orbit on the screen."""
    navigation.open_orbit(0)
    return navigation


def test_views_follow_one_another(orbit):
    seen = []
    for _ in View:
        press(orbit, "v")
        seen.append(orbit.view)
    assert seen == [View.SOURCE, View.SURVEY, View.ORBIT]


@pytest.mark.parametrize("view", View)
def test_digit_shows_a_workspace_of_the_view(orbit, view):
    orbit.turn_to(view)
    for digit, workspace in zip(DIGITS, orbit.workspaces_of_view, strict=False):
        press(orbit, digit)
        assert orbit.workspace is workspace
    press(orbit, "9")
    assert orbit.workspace is orbit.workspaces_of_view[-1]


def test_every_workspace_has_a_digit(orbit):
    for view in View:
        orbit.turn_to(view)
        assert len(orbit.workspaces_of_view) <= len(DIGITS)


def test_brackets_step_through_the_orbits_and_stop_at_the_ends(orbit):
    press(orbit, "[")
    assert requested(orbit) == []
    press(orbit, "]")
    press(orbit, "]")
    assert requested(orbit) == [(1, FitSettings())]


def test_comma_and_full_stop_move_the_range_of_exposures_within_the_orbit(orbit):
    part = orbit.session.shown_part
    lowest, highest = part.param["plates"].bounds
    part.plates = (lowest, lowest + 1)
    press(orbit, ",")
    assert part.plates == (lowest, lowest + 1)
    press(orbit, ".")
    assert part.plates == (lowest + 1, lowest + 2)
    part.plates = (highest, highest)
    press(orbit, ".")
    assert part.plates == (highest, highest)


def test_d_goes_round_the_detectors(orbit):
    part = orbit.session.shown_part
    detectors = part.param["detector"].objects
    part.detector = ALL
    for _ in detectors:
        press(orbit, "d")
    assert part.detector == ALL
    press(orbit, "D")
    assert part.detector == detectors[-1]


def test_b_exchanges_the_two_solutions_and_back(orbit):
    session = orbit.session
    first = session.shown
    press(orbit, "b")
    assert (session.shown, session.other) == (first, None)
    session.choices.order = 4
    session.job.take({"event": "done"})
    session.poll()
    what_if = session.shown
    press(orbit, "b")
    assert (session.shown, session.other, session.choices.order) == (first, what_if, 5)
    press(orbit, "b")
    assert (session.shown, session.other, session.choices.order) == (what_if, first, 4)
    assert session.job is None


def test_f_fits_and_k_keeps(orbit):
    session = orbit.session
    session.choices.order = 4
    session.job.take({"event": "done"})
    session.poll()
    press(orbit, "k")
    assert [s.settings.order for s in session.solutions] == [5, 4]
    session.choices.what_if_at_once = False
    session.choices.order = 3
    press(orbit, "f")
    assert requested(orbit)[-1] == (0, FitSettings(order=3))


@pytest.mark.parametrize("key", [*KEYS, "9", "x", "", "Enter"])
def test_key_of_an_orbit_does_nothing_to_it_elsewhere(orbit, key):
    orbit.turn_to(View.SURVEY)
    session = orbit.session
    before = session.shown_part.address(), session.shown, session.other, requested(orbit)
    press(orbit, key)
    after = session.shown_part.address(), session.shown, session.other, requested(orbit)
    assert after == before
