"""SIGTERM, by which systems ask a process to end: it ends as by Ctrl-C, and cleans up."""

import asyncio
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Protocol

# As a shell reports it.
EXIT_CODE = 128 + signal.SIGTERM
_AGAIN_SECONDS = 0.05


class _Unraisable(Protocol):
    exc_type: type[BaseException]
    exc_value: BaseException | None
    exc_traceback: TracebackType | None


class _Ending:
    """Handler of SIGTERM that raises SystemExit in the main thread, once."""

    def __init__(self) -> None:
        self._has_begun = False
        self._report = sys.unraisablehook

    def begin(self, number: int, frame: FrameType | None) -> None:
        # A repeated signal must not interrupt the removal of scratch folders.
        if self._has_begun:
            return
        self._has_begun = True
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            _exit()
        else:
            # Between two callbacks of the loop: inside one, a library may catch or log it.
            loop.call_soon_threadsafe(_exit)

    def begin_again(self, unraisable: "_Unraisable") -> None:
        """Repeat the signal if Python dropped the SystemExit, as in a callback of the collector."""
        if not isinstance(unraisable.exc_value, SystemExit):
            self._report(unraisable)  # type: ignore[arg-type]
            return
        self._has_begun = False
        timer = threading.Timer(_AGAIN_SECONDS, os.kill, (os.getpid(), signal.SIGTERM))
        timer.daemon = True
        timer.start()


@contextmanager
def ending_on_sigterm() -> Iterator[None]:
    """Make SIGTERM raise SystemExit with `EXIT_CODE` in the block, which the main thread runs."""
    ending = _Ending()
    reporter, sys.unraisablehook = sys.unraisablehook, ending.begin_again
    handler = signal.signal(signal.SIGTERM, ending.begin)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, handler)
        sys.unraisablehook = reporter


def _exit() -> None:
    raise SystemExit(EXIT_CODE)
