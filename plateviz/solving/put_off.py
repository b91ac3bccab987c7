"""PutOff: parts of results that a page does without at first."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress

from solver.errors import InputError

# What such work needs is large: some 100 MB for the eigenmodes of a full orbit.
_MOST = 2

Work = Callable[[], object]


class PutOff:
    """Work of the solver process that waits until no request does, such as the verdict.

    What a page waits for is done next; the rest, such as the eigenmodes, once the process is idle.
    """

    def __init__(self) -> None:
        """Begin without work."""
        self._next: deque[Work] = deque()
        self._waiting: deque[Work] = deque()

    def add(self, work: Work, *, is_next: bool = False) -> None:
        """Put work off.

        Parameters
        ----------
        is_next : whether a page waits for it
        """
        (self._next if is_next else self._waiting).append(work)

    def limit(self) -> None:
        """Do the oldest work of each kind until no more than `_MOST` of it waits."""
        for waiting in (self._next, self._waiting):
            while len(waiting) > _MOST:
                _do(waiting.popleft())

    def finish_next(self) -> None:
        """Do what a page waits for."""
        _finish(self._next)

    def finish(self) -> None:
        """Do all of it."""
        self.finish_next()
        _finish(self._waiting)


def _finish(waiting: deque[Work]) -> None:
    while waiting:
        _do(waiting.popleft())


def _do(work: Work) -> None:
    # A full disk is said where the solution is used, which does without, or by the next fit.
    with suppress(InputError):
        work()
