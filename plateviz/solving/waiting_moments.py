"""WaitingMoments: a long fit waits for a moment while somebody waits for something quick."""

import time
from collections.abc import Callable

# A what-if takes so long, and the page as long to draw it.
_MOMENT_S = 1.5
# The longest that the fit waits, and how long it then goes on whatever is asked for. A few of its
# steps may take twice as long.
_LONGEST_S, _TURN_S = 4.0, 0.5
_LOOK_S = 0.02


class WaitingMoments:
    """When a long fit waits; asked for by one thread, kept by another.

    The cores and their caches are then left to who waits. However much is asked for, the fit gets
    a ninth of the time at least.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin without a moment in which to wait."""
        self._clock = clock
        self._until = self._turn_until = clock()

    def ask(self) -> None:
        """Let the fit wait for the next moment."""
        self._until = self._clock() + _MOMENT_S

    def wait(self, check: Callable[[], object]) -> None:
        """Return when the fit may go on.

        Parameters
        ----------
        check : called again and again meanwhile; an exception from it ends the wait
        """
        begin = self._clock()
        if begin < self._turn_until:
            return
        while (now := self._clock()) < min(self._until, begin + _LONGEST_S):
            check()
            time.sleep(_LOOK_S)
        if now > begin:
            self._turn_until = now + _TURN_S
