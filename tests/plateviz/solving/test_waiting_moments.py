"""Moments in which a long fit waits, and how much of the time it gets nevertheless."""

import pytest

from plateviz.solving import waiting_moments
from plateviz.solving.waiting_moments import WaitingMoments
from solver.errors import CancelledError


class Clock:
    """A clock that runs only while somebody sleeps; asks for moments as often as is wanted."""

    def __init__(self, monkeypatch):
        self.now, self.slept = 100.0, 0.0
        monkeypatch.setattr(waiting_moments.time, "sleep", self.sleep)

    def sleep(self, seconds):
        self.now += seconds
        self.slept += seconds


@pytest.fixture
def clock(monkeypatch):
    return Clock(monkeypatch)


@pytest.fixture
def moments(clock):
    return WaitingMoments(lambda: clock.now)


def test_fit_goes_on_if_nobody_waits(clock, moments):
    moments.wait(lambda: None)
    assert clock.slept == 0.0


def test_fit_waits_for_the_moment_that_is_asked_for(clock, moments):
    moments.ask()
    clock.now += 0.5
    moments.wait(lambda: None)
    assert clock.slept == pytest.approx(1.0, abs=0.05)


def test_fit_gets_a_ninth_of_the_time_whatever_is_asked_for(clock, moments):
    worked = 0.0
    for _ in range(1000):
        moments.ask()
        moments.wait(moments.ask)
        clock.now += 0.1
        worked += 0.1
    assert worked / (worked + clock.slept) == pytest.approx(1 / 9, abs=0.03)


def test_cancelled_fit_ends_while_it_waits(clock, moments):
    def cancelled():
        raise CancelledError("by a person")

    moments.ask()
    with pytest.raises(CancelledError):
        moments.wait(cancelled)
    assert clock.slept == 0.0
