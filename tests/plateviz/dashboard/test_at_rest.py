"""What a page does once it is at rest."""

import pytest

from plateviz.dashboard import at_rest
from plateviz.dashboard.at_rest import AtRest


class Timers:
    """A clock, and functions that it calls later."""

    def __init__(self):
        self.now, self.waiting = 0.0, []

    def later(self, seconds, call):
        self.waiting.append((self.now + seconds, call))

    def pass_to(self, now):
        while self.waiting and self.waiting[0][0] <= now:
            self.now, call = self.waiting.pop(0)
            call()
        self.now = now


@pytest.fixture
def timers(monkeypatch):
    made = Timers()
    monkeypatch.setattr(at_rest.time, "monotonic", lambda: made.now)
    return made


def test_it_waits_until_nothing_has_happened_for_a_while(timers):
    done = []
    rest = AtRest(lambda: done.append(timers.now), 3.0, timers.later)
    for now in (0.0, 1.0, 2.0):
        timers.pass_to(now)
        rest.begin()
        assert len(timers.waiting) == 1
    timers.pass_to(4.9)
    assert done == []
    timers.pass_to(20.0)
    assert done == [5.0]
    rest.begin()
    timers.pass_to(30.0)
    assert done == [5.0, 23.0]


def test_nothing_is_done_for_a_page_that_is_gone(timers):
    done = []
    rest = AtRest(lambda: done.append(1), 3.0, timers.later)
    rest.begin()
    del rest
    timers.pass_to(4.0)
    assert done == []


def test_without_timers_it_is_done_at_once():
    done = []
    AtRest(lambda: done.append(1), 3.0).begin()
    assert done == [1]
