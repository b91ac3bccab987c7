"""Forecasts: how long a job still takes, from those before it and from its own progress."""

import statistics
import threading
from collections import defaultdict, deque
from collections.abc import Mapping
from typing import Any, NamedTuple

from plateviz.solving.job import Job, JobStatus
from plateviz.tables.counts import duration_text
from solver.data.settings import ENGINES

# Number of jobs of a kind that are remembered.
_REMEMBERED = 10

Kind = tuple[object, ...]


class Forecast(NamedTuple):
    """What a job waits for.

    Attributes
    ----------
    ahead : number of jobs that end before it begins
    seconds : until it begins, or, once it runs, until it ends; None if that cannot be told
    """

    ahead: int
    seconds: float | None

    def words(self) -> str:
        """Return the forecast of a job that waits in words."""
        text = "waiting for the solver"
        if self.ahead:
            text += f", {self.ahead} fit{'s' if self.ahead > 1 else ''} before it"
        if self.seconds is not None:
            text += f", begins in about {duration_text(self.seconds)}"
        return text


class JobTimes:
    """How long the jobs of each kind took; readable from any thread."""

    def __init__(self) -> None:
        """Begin without any."""
        self._lock = threading.Lock()
        self._seconds: dict[Kind, deque[float]] = defaultdict(lambda: deque(maxlen=_REMEMBERED))

    def note(self, job: Job) -> None:
        """Remember how long a job took, unless it did not succeed."""
        if job.status is JobStatus.DONE:
            with self._lock:
                self._seconds[_kind(job.request)].append(job.seconds_running)

    def left(self, job: Job) -> float | None:
        """Return the seconds that a job still has to run; None if nothing tells."""
        total, first, done = _steps(job.request), job.first_step, _last_step(job)
        # Before the first step, models are compiled: only the steps after it tell the rate.
        if total and first and done and done > first[0]:
            per_step = (job.seconds_running - first[1]) / (done - first[0])
            return per_step * max(total - done, 0)
        with self._lock:
            before = list(self._seconds[_kind(job.request)])
        return max(statistics.median(before) - job.seconds_running, 0.0) if before else None


def is_long(request: Mapping[str, Any]) -> bool:
    """Return whether a request takes so long that others should not wait for it."""
    return request["do"] == "survey" or _engine(request) not in (None, ENGINES[0])


def _engine(request: Mapping[str, Any]) -> str | None:
    return request.get("settings", {}).get("engine") if request["do"] == "fit" else None


def _kind(request: Mapping[str, Any]) -> Kind:
    return (request["do"], _engine(request), request.get("what_if"))


def _steps(request: Mapping[str, Any]) -> int | None:
    """Return the usual number of steps of an iterative engine; None if there is none."""
    engine, settings = _engine(request), request.get("settings", {})
    if engine == "svi":
        return settings["svi"]["steps"] + settings["svi"]["patience"]
    if engine == "nuts":
        nuts = settings["nuts"]
        return nuts["chains"] * nuts["samples"]
    return None


def _last_step(job: Job) -> int | None:
    last = job.progress[-1:]
    step = last[0].get("iteration") if last else None
    return step if isinstance(step, int) else None
