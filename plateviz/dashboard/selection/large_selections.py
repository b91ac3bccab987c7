"""LargeSelections: what was selected that is too large for an address, by its keys."""

from typing import Any

import numpy as np

from plateviz.dashboard.selection.selected import keys_of
from solver.data.subset import KINDS, Subset

# What is remembered at most, in 16 MB and less: that of a few dozen pages.
_MOST, _MOST_IDS = 400, 1_000_000


class LargeSelections:
    """The large selections of a server's sessions, so that their addresses can be opened again.

    The key of a selection follows from its ids: only who had these ids has it.
    """

    def __init__(self) -> None:
        """Remember nothing yet."""
        # The latest is the last one.
        self._known: dict[tuple[str, str], np.ndarray] = {}

    def remember(self, selected: Subset) -> None:
        """Remember the kinds of a selection that are too large; the oldest are forgotten."""
        items = selected.by_kind()
        for kind, key in keys_of(selected).items():
            known = self._known.pop((kind, key), None)
            # A set takes five times the memory.
            self._known[kind, key] = np.array([*items[kind]]) if known is None else known
        while len(self._known) > len(KINDS) and not self._has_room:
            del self._known[next(iter(self._known))]

    def find(self, kind: str, key: str) -> frozenset[Any] | None:
        """Return the items of a kind with a key; None if they are not known, or forgotten."""
        known = self._known.get((kind, key))
        if known is None:
            return None
        rows = known.tolist()
        return frozenset(map(tuple, rows) if known.ndim > 1 else rows)

    @property
    def _has_room(self) -> bool:
        return len(self._known) <= _MOST and sum(map(np.size, self._known.values())) <= _MOST_IDS
