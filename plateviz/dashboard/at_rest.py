"""AtRest: does something once a page has been at rest for some seconds."""

import time
from collections.abc import Callable
from weakref import WeakMethod

Later = Callable[[float, Callable[[], None]], object]
"""Calls a function after some seconds, as `IOLoop.call_later` does."""


class AtRest:
    """Waits until nothing has happened for some seconds; while it waits, there is one timer."""

    def __init__(
        self, act: Callable[[], object], seconds: float, later: Later | None = None
    ) -> None:
        """Begin at rest.

        Parameters
        ----------
        act : what is to be done
        later : None where nothing can be called later, so that `act` is called at once
        """
        self._act, self._seconds, self._later = act, seconds, later
        self._until = 0.0
        self._is_waiting = False

    def begin(self) -> None:
        """Do it once the page has been at rest from now on."""
        if self._later is None:
            self._act()
            return
        self._until = time.monotonic() + self._seconds
        if not self._is_waiting:
            self._wait(self._seconds)

    def _wait(self, seconds: float) -> None:
        if self._later is not None:
            self._is_waiting = True
            # A page that is closed meanwhile is not kept for it.
            look = WeakMethod(self._look)
            self._later(seconds, lambda: _call(look))

    def _look(self) -> None:
        self._is_waiting = False
        left = self._until - time.monotonic()
        # A timer may be a little early.
        if left > 0.01:
            self._wait(left)
        else:
            self._act()


def _call(method: WeakMethod[Callable[[], None]]) -> None:
    found = method()
    if found is not None:
        found()
