"""Memory is given back once pages that have ended are collected, however many there are."""

import pytest

from plateviz.dashboard.serving import returned_memory
from plateviz.dashboard.serving.returned_memory import ReturnedMemory


class Loop:
    """An event loop whose time is set by the test."""

    def __init__(self):
        self.now, self.calls = 100.0, []

    def call_later(self, seconds, call):
        self.calls.append((self.now + seconds, call))

    def go_to(self, now):
        while self.calls and self.calls[0][0] <= now:
            self.now, call = self.calls.pop(0)
            call()
        self.now = now


@pytest.fixture
def loop(monkeypatch):
    made = Loop()
    monkeypatch.setattr(returned_memory.time, "monotonic", lambda: made.now)
    return made


def test_pages_that_end_together_are_one(loop):
    trimmed = []
    memory = ReturnedMemory(loop, lambda: trimmed.append(loop.now))
    for _ in range(20):
        memory.note_end()
    loop.go_to(114.0)
    assert trimmed == []
    loop.go_to(200.0)
    assert trimmed == [115.0]


def test_page_that_ends_in_between_is_waited_for(loop):
    trimmed = []
    memory = ReturnedMemory(loop, lambda: trimmed.append(loop.now))
    memory.note_end()
    loop.go_to(110.0)
    memory.note_end()
    loop.go_to(200.0)
    assert trimmed == [115.0, 130.0]
    memory.note_end()
    loop.go_to(300.0)
    assert trimmed == [115.0, 130.0, 215.0]


def test_library_is_asked(loop):
    # It says nothing of how much it gives back; a wrong call would end the process.
    ReturnedMemory(loop).note_end()
    loop.go_to(200.0)
    assert loop.calls == []
