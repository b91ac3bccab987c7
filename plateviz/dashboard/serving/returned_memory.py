"""Returned memory: what a closed page took goes back to the machine.

Three things are in the way. Panel keeps the first page of a process for ever, and makes Bokeh's
default document the page that was at work when another one began. The C library keeps what Python
has freed, in case that it is asked for it again.
"""

import ctypes
import time
from collections.abc import Callable
from typing import Any

import panel as pn
from bokeh.document import Document
from bokeh.io.state import curstate
from tornado.ioloop import IOLoop

# Panel collects what refers to itself within ten seconds after the end of a page.
_SECONDS = 15.0


def keep_no_first_page(loop: IOLoop) -> None:
    """Let Panel begin a task of the whole process now, not within the first page.

    The task forgets callbacks that have not ended. It goes on for as long as the process, with the
    context variables of where it was begun, of which one is the page.
    """
    # It has no public name in Panel 1.9; Panel 1.10 still keeps its first page.
    state: Any = pn.state
    loop.add_callback(state._schedule_busy_cleanup)  # noqa: SLF001


class ReturnedMemory:
    """Gives memory back some time after pages have ended, once for all of that time."""

    def __init__(self, loop: IOLoop, trim: Callable[[], object] | None = None) -> None:
        """Begin without a page.

        Parameters
        ----------
        trim : gives freed memory back; by default that of the C library, where it can
        """
        self._loop, self._trim = loop, trim or _trim_of_library
        self._last_end = 0.0
        self._is_waiting = False

    def follow(self) -> None:
        """Follow the page that is being made to its end."""
        pn.state.on_session_destroyed(lambda _: self.note_end())
        self._loop.add_callback(_keep_no_page_as_default)

    def note_end(self) -> None:
        """Give memory back later, when a page that has just ended is collected."""
        self._last_end = time.monotonic()
        self._wait()

    def _wait(self) -> None:
        if not self._is_waiting:
            self._is_waiting = True
            self._loop.call_later(_SECONDS, self._give_back)

    def _give_back(self) -> None:
        self._is_waiting = False
        self._trim()
        if time.monotonic() - self._last_end < _SECONDS:
            # What that page took may not be collected yet.
            self._wait()


def _keep_no_page_as_default() -> None:
    curstate().document = Document()


def _trim_of_library() -> None:
    # Only the GNU C library has it.
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
