"""Turns: work of many pages that is done one after the other, in the order of the requests.

Work that keeps the interpreter busy would otherwise share it among all who ask, and leave little to
the pages.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Turns:
    """A queue of threads, of which the first works."""

    def __init__(self) -> None:
        """Begin with nobody in the queue."""
        self._queue: list[object] = []
        self._has_moved = threading.Condition()

    @contextmanager
    def turn(self, wait: Callable[[int], object]) -> Iterator[None]:
        """Wait for this thread's turn, which ends with the block.

        Parameters
        ----------
        wait : called with the number of threads that are before this one, whenever that changes
        """
        mine = object()
        with self._has_moved:
            self._queue.append(mine)
        try:
            self._wait_for_turn(mine, wait)
            yield
        finally:
            with self._has_moved:
                self._queue.remove(mine)
                self._has_moved.notify_all()

    def _wait_for_turn(self, mine: object, wait: Callable[[int], object]) -> None:
        with self._has_moved:
            while place := self._queue.index(mine):
                wait(place)
                self._has_moved.wait()
