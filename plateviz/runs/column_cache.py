"""ColumnCache: the columns of large tables that were read last, up to a number of bytes."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable

import numpy as np

Arrays = tuple[np.ndarray, ...]
LIMIT = 512 * 2**20
"""Bytes that are kept by default: five columns of 25 million rows with four bytes each."""


class ColumnCache:
    """Arrays by key; those that nobody has asked for the longest are forgotten first.

    One cache serves all sessions of a server. Several threads may ask at once: the same arrays are
    made once, and others are not waited for.
    """

    def __init__(self, limit: int = LIMIT) -> None:
        """Keep at most `limit` bytes."""
        self._limit = limit
        self._lock = threading.Lock()
        self._kept: OrderedDict[Hashable, Arrays] = OrderedDict()
        self._being_made: dict[Hashable, threading.Lock] = {}

    def arrays(self, key: Hashable, make: Callable[[], Arrays]) -> Arrays:
        """Return the arrays of a key; `make` makes them unless they are kept.

        What `make` raises is raised, and nothing is kept.
        """
        with self._lock:
            being_made = self._being_made.setdefault(key, threading.Lock())
        with being_made:
            with self._lock:
                if key in self._kept:
                    self._kept.move_to_end(key)
                    self._being_made.pop(key, None)
                    return self._kept[key]
            made = make()
            for one in made:
                one.flags.writeable = False
            with self._lock:
                self._being_made.pop(key, None)
                self._kept[key] = made
                self._forget()
            return made

    @property
    def size(self) -> int:
        """Bytes that are kept."""
        with self._lock:
            return sum(map(_bytes_of, self._kept.values()))

    def _forget(self) -> None:
        total = sum(map(_bytes_of, self._kept.values()))
        while total > self._limit:
            _, oldest = self._kept.popitem(last=False)
            total -= _bytes_of(oldest)


def _bytes_of(arrays: Arrays) -> int:
    return sum(one.nbytes for one in arrays)
