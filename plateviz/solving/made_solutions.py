"""MadeSolutions: what each browser session has made and has asked for, kept by the server.

A page that is loaded again is a new session of the server; its browser tells the key of the old
one, and finds its solutions and the fit that it waited for again.
"""

import re
from collections import OrderedDict
from collections.abc import Callable
from typing import NamedTuple
from weakref import WeakMethod

from plateviz.solving.job import Job, JobStatus
from solver.data.settings import FitSettings

KEY = re.compile(r"[0-9a-f]{32}")
"""What a browser session calls itself: random, so that no other one finds its solutions."""
_MOST_KEYS, _MOST_OF_A_KEY, _MOST_AWAITED = 500, 100, 10
_LONGEST_NAME = 60


class MadeSolution(NamedTuple):
    """A solution that a session has made.

    Attributes
    ----------
    orbit : orbit_id; None for files of one orbit
    settings : of the fit
    is_what_if : whether it was computed by a what-if
    name : that a person gave it; empty for none
    """

    orbit: int | None
    settings: FitSettings
    is_what_if: bool
    name: str = ""

    def is_of(self, other: "MadeSolution") -> bool:
        """Whether both are the same solution, whatever their names."""
        return self == other._replace(name=self.name)


class Awaited(NamedTuple):
    """A solution that a session has asked for.

    Attributes
    ----------
    made : the solution
    job : that makes it
    let_go : method that lets the session hold the job no longer; the session may be gone
    """

    made: MadeSolution
    job: Job
    let_go: WeakMethod[Callable[[], object]]


class _OfKey(NamedTuple):
    """What a session has made, in that order, and what it has asked for."""

    made: list[MadeSolution]
    awaited: list[Awaited]


class MadeSolutions:
    """The solutions of all sessions of a server; those used last are kept."""

    def __init__(self) -> None:
        """Begin without any."""
        self._of: OrderedDict[str, _OfKey] = OrderedDict()

    def of(self, key: str) -> list[MadeSolution]:
        """Return the solutions of a session in the order in which they were made.

        They include those that were asked for and became complete while nobody looked. A what-if
        is none of them: the next one would have replaced it.
        """
        for one in [one for one in self.awaited(key) if one.job.status.is_over]:
            self.forget(key, one.job)
            if one.job.status is JobStatus.DONE and not one.made.is_what_if:
                self.remember(key, one.made)
        return list(self._of[key].made) if key in self._of else []

    def remember(self, key: str, made: MadeSolution) -> None:
        """Add a solution of a session, or give it another name."""
        found = self._used(key)
        if found is None:
            return
        before = found.made
        name = made.name.strip()[:_LONGEST_NAME]
        named = made._replace(name=name)
        if any(one.is_of(made) for one in before):
            before[:] = [named if one.is_of(made) and name else one for one in before]
        else:
            before.append(named)
        del before[:-_MOST_OF_A_KEY]

    def expect(self, key: str, awaited: Awaited) -> None:
        """Remember what a session has asked for, until it is forgotten or complete."""
        found = self._used(key)
        if found is not None:
            found.awaited.append(awaited)
            del found.awaited[:-_MOST_AWAITED]

    def forget(self, key: str, job: Job) -> None:
        """Expect a job no longer: it was cancelled, or its session has its solution."""
        if key in self._of:
            awaited = self._of[key].awaited
            awaited[:] = [one for one in awaited if one.job is not job]

    def awaited(self, key: str) -> list[Awaited]:
        """Return what a session has asked for and not been answered, the last one last."""
        return list(self._of[key].awaited) if key in self._of else []

    def move(self, before: str, key: str) -> None:
        """Add what one session has made and asked for to those of another."""
        if before in self._of:
            found = self._of.pop(before)
            for made in found.made:
                self.remember(key, made)
            for awaited in found.awaited:
                self.expect(key, awaited)

    def _used(self, key: str) -> _OfKey | None:
        """Return what a key has, as the one that was used last; None if it is no key."""
        if not KEY.fullmatch(key):
            return None
        self._of[key] = self._of.pop(key, None) or _OfKey([], [])
        while len(self._of) > _MOST_KEYS:
            self._of.popitem(last=False)
        return self._of[key]
