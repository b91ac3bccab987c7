"""Rooms of cards that earlier pages have told of, and what a client may tell of its window."""

import pytest

from plateviz.dashboard.serving import rooms
from plateviz.dashboard.serving.rooms import BrowserWindow, Rooms, browser_window_from

WINDOW = BrowserWindow(1920, 1080, is_dark=False)


def test_rooms_are_those_of_the_same_cards_in_a_window_of_the_same_size():
    known = Rooms()
    known.note(WINDOW, ["a", "b"], "a", (500, 300))
    known.note(WINDOW, ["a", "b"], "a", (510, 310))
    assert known.of(WINDOW._replace(is_dark=True), ["a", "b"]) == {"a": (510, 310)}
    assert known.of(WINDOW, ["a"]) == {}
    assert known.of(WINDOW._replace(width=1366), ["a", "b"]) == {}


def test_windows_that_have_not_been_seen_for_long_are_forgotten(monkeypatch):
    monkeypatch.setattr(rooms, "_MOST", 3)
    known = Rooms()
    for width in range(1000, 1010):
        known.note(WINDOW._replace(width=width), ["a"], "a", (500, 300))
    assert known.of(WINDOW._replace(width=1006), ["a"]) == {}
    assert known.of(WINDOW._replace(width=1007), ["a"]) == {"a": (500, 300)}


def test_window_is_what_a_browser_tells():
    told = {"width": 1920, "height": 1080, "is_dark": True, "more": "ignored"}
    assert browser_window_from(told) == BrowserWindow(1920, 1080, is_dark=True)


@pytest.mark.parametrize(
    "told",
    [
        None,
        [],
        "1920x1080",
        {},
        {"width": "1920", "height": 1080, "is_dark": True},
        {"width": 1920, "height": 1080, "is_dark": "yes"},
        {"width": 0, "height": 1080, "is_dark": True},
        {"width": 1920, "height": 10**9, "is_dark": True},
        {"width": 1920.5, "height": 1080, "is_dark": True},
    ],
)
def test_anything_else_is_no_window(told):
    assert browser_window_from(told) is None
