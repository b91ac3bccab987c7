"""PutOff: parts of results that a page does without at first."""

from collections import deque
from collections.abc import Callable

# What such work needs is large: some 100 MB for the eigenmodes of a full orbit.
_MOST = 2


class PutOff:
    """Work of the solver process that waits until it is idle, such as the eigenmodes."""

    def __init__(self) -> None:
        """Begin without work."""
        self._waiting: deque[Callable[[], object]] = deque()

    def add(self, work: Callable[[], object]) -> None:
        """Put work off; if too much waits, do the oldest now."""
        self._waiting.append(work)
        if len(self._waiting) > _MOST:
            self._waiting.popleft()()

    def finish(self) -> None:
        """Do all of it."""
        while self._waiting:
            self._waiting.popleft()()
