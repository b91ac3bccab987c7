"""MadeSolutions: which solutions each browser session has made, kept by the server.

A page that is loaded again is a new session of the server; its browser tells the key of the old
one, and finds its solutions again.
"""

import re
from collections import OrderedDict
from typing import NamedTuple

from solver.data.settings import FitSettings

KEY = re.compile(r"[0-9a-f]{32}")
"""What a browser session calls itself: random, so that no other one finds its solutions."""
_MOST_KEYS, _MOST_OF_A_KEY = 500, 100
_LONGEST_NAME = 60


class MadeSolution(NamedTuple):
    """A solution that a session has made.

    Attributes
    ----------
    orbit : orbit_id; None for files of one orbit
    settings : of the fit
    is_step : whether it was computed by a what-if
    name : that a person gave it; empty for none
    """

    orbit: int | None
    settings: FitSettings
    is_step: bool
    name: str = ""

    def is_of(self, other: "MadeSolution") -> bool:
        """Whether both are the same solution, whatever their names."""
        return self[:3] == other[:3]


class MadeSolutions:
    """The solutions of all sessions of a server; those used last are kept."""

    def __init__(self) -> None:
        """Begin without any."""
        self._of: OrderedDict[str, list[MadeSolution]] = OrderedDict()

    def of(self, key: str) -> list[MadeSolution]:
        """Return the solutions of a session in the order in which they were made."""
        return list(self._of.get(key, ()))

    def remember(self, key: str, made: MadeSolution) -> None:
        """Add a solution of a session, or give it another name."""
        if not KEY.fullmatch(key):
            return
        before = self._of.pop(key, [])
        name = made.name.strip()[:_LONGEST_NAME]
        named = made._replace(name=name)
        if any(one.is_of(made) for one in before):
            before = [named if one.is_of(made) and name else one for one in before]
        else:
            before.append(named)
        self._of[key] = before[-_MOST_OF_A_KEY:]
        while len(self._of) > _MOST_KEYS:
            self._of.popitem(last=False)
