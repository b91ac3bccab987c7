"""Growth of a run, in words, look by look."""

from pathlib import Path

import pytest

from plateviz.dashboard.navigation.growth import Growth, how_to_make_another_run
from plateviz.runs.run import RunProgress
from plateviz.solving.origin import SurveyFolder


class Clock:
    """A clock that is set by hand, in seconds."""

    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def growth(clock):
    return Growth(Path("a sky"), "default", clock)


def progress(n_fitted, n_failed=0, is_gathered=False, is_complete=False):
    return RunProgress(54, n_fitted, n_failed, is_gathered, is_complete)


def test_rate_and_rest_are_those_of_what_was_added(growth, clock):
    assert growth.look(progress(10)) == "10 of 54 orbits are done. This page follows by itself."
    clock.now = 30.0
    words = growth.look(progress(25))
    assert words.startswith("25 of 54 orbits are done, 30 per minute, about 58 s left.")
    # Waiting changes neither: the rate is that of the orbits that are there.
    clock.now = 32.0
    assert growth.look(progress(25)) == words


def test_single_orbit_takes_the_singular(growth):
    assert growth.look(RunProgress(1, 0, 0, False, False)).startswith("0 of 1 orbit is done. ")


def test_failed_orbits_are_done(growth, clock):
    growth.look(progress(10))
    clock.now = 60.0
    words = growth.look(progress(14, 2))
    assert "16 of 54 orbits are done, 6 per minute, about 6 min left" in words


def test_command_is_given_if_nothing_is_added(growth, clock):
    growth.look(progress(10))
    clock.now = 121.0
    words = growth.look(progress(10))
    assert words.endswith("some minutes: `plateviz survey 'a sky' --run default` continues it.")
    assert growth.look(progress(11)).endswith("follows by itself.")


def test_tables_are_the_last_to_be_written(growth):
    assert growth.look(progress(53, 1)).startswith("54 of 54 orbits are done; the tables over all")


@pytest.mark.parametrize(
    "last", [progress(54, is_gathered=True, is_complete=True), progress(53, 1, is_gathered=True)]
)
def test_nothing_is_said_when_nothing_is_to_come(growth, last):
    assert growth.look(last) == ""


def test_run_of_a_watched_survey_waits_for_the_next_orbit(growth, clock):
    done = RunProgress(4, 4, 0, True, False, (0, 1, 2, 3), grows=True)
    assert growth.look(done).startswith("All orbits that have arrived are done.")
    assert growth.look(done._replace(n_orbits=5)).startswith("4 of 5 orbits are done.")
    clock.now = 121.0
    words = growth.look(done._replace(n_orbits=5))
    assert words.endswith("`plateviz watch 'a sky' --run default` continues it.")
    assert growth.look(done._replace(n_orbits=5, n_fitted=5, is_complete=True)) == ""


def test_another_run_is_what_the_verdict_suggests():
    origin = SurveyFolder("my survey")
    words = how_to_make_another_run(origin, "default", ("--drift", "3"))
    assert "`plateviz survey 'my survey' --run other --drift 3` makes" in words
    assert "the verdict suggests" in words
    assert "--order 3` makes" in how_to_make_another_run(origin, "default")
