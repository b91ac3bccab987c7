"""SolverPool: several solver processes, so that what is quick does not wait for what is not.

Half of the processes, the first among them, do quick work only: fits with the first engine and
what-ifs. The others give way to them: each runs long fits, one after the other, and quick work only
while it has none. A what-if goes to the process that has fitted its orbit, since another one would
have to fit it again; but if many wait there, to another one that can begin with the solution of a
run. What nobody waits for yet, and a long fit, pause while somebody waits for a quick one.
"""

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Protocol
from weakref import WeakKeyDictionary

from plateviz.solving.capacity import ready_orbits
from plateviz.solving.forecast import JobTimes, is_long
from plateviz.solving.job import Job
from plateviz.solving.solver_queue import SolverQueue

# How far the processes give way to those of the server and of a browser, for which many wait, and
# the one of long fits to the others.
_QUICK, _LONG = 2, 19
# Quick jobs of one process before another is started for the next one, which has to fit its orbit.
_FEW = 3
# For so long after another person's request, nothing is prepared for one person but an orbit.
_BUSY_SECONDS = 5.0
# For so many seconds nothing speculative starts when others ask for a what-if.
_FOR_A_WHAT_IF = 1.0
# How many more jobs than elsewhere wait before an orbit is made ready in another process.
_MORE = 2


class Solver(Protocol):
    """What runs jobs: a queue or a pool of them."""

    def submit(self, job: Job) -> Job:
        """Put a job at the end of a queue and return it."""
        ...

    def prepare(self, request: Mapping[str, object]) -> None:
        """Send a request for preparations, which give way to every job."""
        ...

    def pause(self) -> None:
        """Let what processes prepare wait for a moment."""
        ...

    def rest(self) -> None:
        """Let processes give up what they prepare."""
        ...

    def complete(self, job: Job, part: str) -> bool:
        """Let a process write a part of a result that was put off; return whether it will."""
        ...

    def cancel(self, job: Job) -> None:
        """Cancel a job that waits or runs."""
        ...

    def close(self) -> None:
        """End all processes and cancel all jobs that are not over."""
        ...


class SolverPool:
    """Up to a number of queues, each with a process of its own; the others start when needed."""

    def __init__(self, most: int, start: Callable[..., SolverQueue] = SolverQueue) -> None:
        """Start the first process.

        Parameters
        ----------
        most : number of processes; half of them, or one less, run long fits
        start : makes a queue, with the arguments of `SolverQueue`
        """
        times = JobTimes()
        self._lock = threading.Lock()
        self._most, self._most_long = most, most // 2
        self._n_ready = most * ready_orbits()
        self._start = partial(start, times=times)
        self._quick, self._long = [self._start(niceness=_QUICK)], list[SolverQueue]()
        # The queue that has last fitted an orbit, the latest last.
        self._warm: OrderedDict[str, SolverQueue] = OrderedDict()
        # When something quick was last asked for, by orbit, as from `time.monotonic`.
        self._asked: dict[str, float] = {}
        # The queue of each job that somebody still knows.
        self._of_job: WeakKeyDictionary[Job, SolverQueue] = WeakKeyDictionary()

    def submit(self, job: Job) -> Job:
        """Put a job at the end of the queue that suits it best and return it."""
        with self._lock:
            queue = self._of_job[job] = self._queue_for(job.request)
            self._warm[_orbit(job.request)] = queue
            self._warm.move_to_end(_orbit(job.request))
            while len(self._warm) > self._n_ready:
                self._warm.popitem(last=False)
            if not is_long(job.request):
                self._asked[_orbit(job.request)] = time.monotonic()
                self._pause_others(queue)
            return queue.submit(job)

    def prepare(self, request: Mapping[str, object]) -> None:
        """Send a request for preparations to the process that will answer what-ifs of its orbit."""
        with self._lock:
            queue = self._warm.get(_orbit(request), self._quick[0])
            self._warm[_orbit(request)] = queue
            queue.prepare({**request, "only_fit": self._is_busy(_orbit(request))})

    def pause(self) -> None:
        """Let what processes prepare wait for a moment."""
        for queue in self._all():
            queue.pause()

    def rest(self) -> None:
        """Let processes give up what they prepare."""
        for queue in self._all():
            queue.rest()

    def complete(self, job: Job, part: str) -> bool:
        """Let its process write a part of a result that was put off; return whether it will."""
        with self._lock:
            # The result of a job that no queue has had was prepared for its orbit.
            queue = self._of_job.get(job) or self._warm.get(_orbit(job.request))
        return queue is not None and queue.complete(job, part)

    def cancel(self, job: Job) -> None:
        """Cancel a job that waits or runs."""
        for queue in self._all():
            queue.cancel(job)

    def close(self) -> None:
        """End all processes and cancel all jobs that are not over."""
        for queue in self._all():
            queue.close()

    def _all(self) -> list[SolverQueue]:
        with self._lock:
            return [*self._quick, *self._long]

    def _is_busy(self, orbit: str) -> bool:
        """Return whether somebody has just asked for something quick of another orbit."""
        since = time.monotonic() - _BUSY_SECONDS
        self._asked = {one: at for one, at in self._asked.items() if at > since}
        return any(one != orbit for one in self._asked)

    def _pause_others(self, queue: SolverQueue) -> None:
        """Leave the cores to a job that somebody waits for."""
        for other in (*self._quick, *self._long):
            if other is not queue:
                other.pause(_FOR_A_WHAT_IF)

    def _queue_for(self, request: Mapping[str, Any]) -> SolverQueue:
        if self._most == 1:
            return self._quick[0]
        if is_long(request):
            return self._queue_of_long_fits()
        free = [q for q in self._long if not any(is_long(job.request) for job in q.jobs)]
        best = _least_busy(candidates := [*self._quick, *free])
        has_room = len(self._quick) < self._most - self._most_long
        if has_room and _can_begin_elsewhere(request) and _is_awaited(best):
            self._start_beside(request)
            has_room = False
        warm = self._warm.get(_orbit(request))
        if warm in candidates and not (_can_begin_elsewhere(request) and _is_behind(warm, best)):
            return warm
        if len(best.jobs) <= _FEW:
            return best
        if has_room:
            self._quick.append(self._start(niceness=_QUICK))
            return self._quick[-1]
        return best if self._long else self._queue_of_long_fits()

    def _start_beside(self, request: Mapping[str, Any]) -> None:
        """Start another process for quick work, which gets ready while the others go on."""
        self._quick.append(self._start(niceness=_QUICK))
        self._quick[-1].submit(Job({**request, "do": "get ready"}))

    def _queue_of_long_fits(self) -> SolverQueue:
        """Return the queue of long fits with the fewest jobs, a new one if none is without."""
        best = _least_busy(self._long) if self._long else None
        if best is not None and (not best.jobs or len(self._long) == self._most_long):
            return best
        self._long.append(self._start(niceness=_LONG))
        return self._long[-1]


def _least_busy(queues: list[SolverQueue]) -> SolverQueue:
    return min(queues, key=lambda queue: len(queue.jobs))


def _is_awaited(queue: SolverQueue) -> bool:
    """Return whether somebody waits for a job of a queue."""
    return not all(job.status.is_over for job in queue.jobs)


def _is_behind(queue: SolverQueue, best: SolverQueue) -> bool:
    """Return whether the jobs of a queue take longer than to make an orbit ready in another one."""
    return len(queue.jobs) - len(best.jobs) >= _MORE


def _can_begin_elsewhere(request: Mapping[str, Any]) -> bool:
    """Return whether a process can begin a what-if from a run, if it has not fitted the orbit."""
    return request.get("base") is not None


def _orbit(request: Mapping[str, Any]) -> str:
    return f"{request.get('origin')} {request.get('orbit')}"
