"""PutOff: parts of results that a page does without at first."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress

from solver.errors import InputError

# What such work needs is large: some 100 MB for the eigenmodes of a full orbit.
_MOST = 2

Work = Callable[[], object]


class PutOff:
    """Work of the solver process that waits until no request does.

    A page waits for the verdict, which is done next. Few pages show eigenmodes: they are done
    once the process is idle, and not at all if it never is and nobody asks for them.
    """

    def __init__(self) -> None:
        """Begin without work."""
        self._verdicts: deque[Work] = deque()
        self._eigenmodes: deque[Work] = deque()

    def add_verdict(self, work: Work) -> None:
        """Put the verdict on a result off."""
        self._verdicts.append(work)

    def add_eigenmodes(self, work: Work) -> None:
        """Put the eigenmodes of a result off."""
        self._eigenmodes.append(work)

    def limit(self) -> None:
        """Let few results wait: do the oldest verdicts, and give up the oldest eigenmodes."""
        while len(self._verdicts) > _MOST:
            _do(self._verdicts.popleft())
        while len(self._eigenmodes) > _MOST:
            self._eigenmodes.popleft()

    def finish_verdicts(self) -> None:
        """Do all verdicts."""
        _finish(self._verdicts)

    def finish(self) -> None:
        """Do all of it."""
        self.finish_verdicts()
        _finish(self._eigenmodes)


def _finish(waiting: deque[Work]) -> None:
    while waiting:
        _do(waiting.popleft())


def _do(work: Work) -> None:
    # A full disk is said where the solution is used, which does without, or by the next fit.
    with suppress(InputError):
        work()
