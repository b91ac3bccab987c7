"""Rooms: how large the cards of figures were in windows of a size, so that others begin with them.

A figure is drawn for the room that the browser has given its card. Once one page has told this, the
figures of the next page in a window of the same size are drawn before it is shown.
"""

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

# Number of combinations of a window's size and cards that are remembered.
_MOST = 200
_LARGEST = 20_000

Room = tuple[int, int]


class BrowserWindow(NamedTuple):
    """The window of a browser: its size in screen pixels, and the theme of its system."""

    width: int
    height: int
    is_dark: bool


class Rooms:
    """Rooms of cards by window and grid; one for a server."""

    def __init__(self) -> None:
        """Begin without any."""
        self._rooms: OrderedDict[tuple[Room, tuple[str, ...]], dict[str, Room]] = OrderedDict()

    def of(self, window: BrowserWindow, cards: Sequence[str]) -> Mapping[str, Room]:
        """Return the room of each card of a grid that was on the screen at first."""
        return dict(self._rooms.get(_key(window, cards), {}))

    def note(self, window: BrowserWindow, cards: Sequence[str], name: str, room: Room) -> None:
        """Remember the room of a card.

        Parameters
        ----------
        cards : names of all cards of its grid, in order
        """
        key = _key(window, cards)
        self._rooms.setdefault(key, {})[name] = room
        self._rooms.move_to_end(key)
        while len(self._rooms) > _MOST:
            self._rooms.popitem(last=False)


def browser_window_from(told: Any) -> BrowserWindow | None:  # noqa: ANN401 whatever a client sends
    """Return the window that a client has told of; None if it is no window."""
    match told:
        case {"width": int(width), "height": int(height), "is_dark": bool(is_dark)}:
            pass
        case _:
            return None
    is_size = all(0 < length <= _LARGEST for length in (width, height))
    return BrowserWindow(width, height, is_dark) if is_size else None


def _key(window: BrowserWindow, cards: Sequence[str]) -> tuple[Room, tuple[str, ...]]:
    return (window.width, window.height), tuple(cards)
