"""SolverQueue: runs one solver process, sends it jobs, and can always stop it.

The process is restarted if it dies or does not stop on request. The job that it was running is
then marked as failed or cancelled; waiting jobs continue.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

from plateviz.cache import keep_compilations
from plateviz.runs.scratch_result import VERDICT
from plateviz.runs.worker_scratch import remove_worker_scratch
from plateviz.solving.forecast import Forecast, JobTimes
from plateviz.solving.job import Job
from plateviz.tables.counts import duration_text
from solver.io.scratch import temporary_folder

# A fit checks for a cancellation between iterations, which take well under a second; but the first
# one compiles, and other work may slow all down. A new process takes seconds, too, and has lost all
# that what-ifs start from.
_GRACE_SECONDS = 15.0
# Time in which the process removes what it has not finished.
_END_SECONDS = 5.0
_SHORT_SECONDS = 5.0
# For so long nothing speculative starts when a page opens.
_FOR_A_PAGE = 2.0


class SolverQueue:
    """One solver process and its queue of jobs, first in, first out."""

    def __init__(self, niceness: int = 0, times: JobTimes | None = None) -> None:
        """Start the process; it warms up while the caller goes on.

        Parameters
        ----------
        niceness : how far the process, and all that it starts, gives way to other processes
        times : how long jobs took, if other queues have run some
        """
        keep_compilations()
        self._times = times or JobTimes()
        self._niceness = niceness
        self._lock = threading.RLock()
        self._jobs: deque[Job] = deque()
        # Requests for verdicts, each with the job after which it is sent.
        self._verdicts: list[tuple[Job, Mapping[str, object]]] = []
        self._process: subprocess.Popen[str] | None = None
        self._is_closed = False
        self._start()

    def submit(self, job: Job) -> Job:
        """Put a job at the end of the queue and return it; after `close`, cancelled."""
        job.tell_by(lambda: self._forecast(job))
        with self._lock:
            if self._is_closed:
                job.cancel()
                return job
            self._jobs.append(job)
            if len(self._jobs) == 1:
                self._send(job.request)
        return job

    @property
    def jobs(self) -> list[Job]:
        """The running job and those that wait, in order."""
        with self._lock:
            return list(self._jobs)

    def _forecast(self, job: Job) -> str:
        """Return in words how long a job waits, or still runs; empty if nothing tells."""
        jobs = self.jobs
        if job not in jobs:
            return ""
        place = jobs.index(job)
        if place == 0:
            left = self._times.left(job)
            # A fit that is nearly over needs no forecast.
            if left is None or left < _SHORT_SECONDS:
                return ""
            return f", about {duration_text(left)} left"
        before = [self._times.left(one) for one in jobs[:place]]
        known = [seconds for seconds in before if seconds is not None]
        return Forecast(place, sum(known) if len(known) == place else None).words()

    def prepare(self, request: Mapping[str, object]) -> None:
        """Send a request for preparations, which give way to every job; nothing is reported.

        After `close` there are none.
        """
        with self._lock:
            if not self._is_closed:
                self._send({"do": "prepare", **request})

    def pause(self, seconds: float = _FOR_A_PAGE) -> None:
        """Let what the process prepares wait for some seconds, or a long fit for a moment."""
        self._tell({"do": "pause", "seconds": seconds})

    def rest(self) -> None:
        """Let the process give up what it prepares."""
        self._tell({"do": "rest"})

    def _tell(self, request: Mapping[str, object]) -> None:
        with self._lock:
            if self._process is not None:
                self._send(request)

    def complete(self, job: Job, part: str) -> bool:
        """Let the process write a part of a result that it has put off; return whether it will.

        A verdict, which few wait for, follows the jobs that wait now. A new process computes the
        part again. After `close` there is none.
        """
        request = {**job.request, "do": "complete", "part": part}
        with self._lock:
            if self._is_closed:
                return False
            if part == VERDICT and self._jobs:
                self._verdicts.append((self._jobs[-1], request))
            else:
                self._send(request)
            return True

    def cancel(self, job: Job) -> None:
        """Cancel a job; its process ends it at its next progress event, or is killed after a while.

        A fit is over for those who wait for it at once, since it leaves nothing that is half
        written. The jobs behind it wait until the process has ended it.
        """
        with self._lock:
            if job not in self._jobs:
                return
            if job is not self._jobs[0]:
                self._jobs.remove(job)
                job.cancel()
                return
            self._send({"do": "cancel", "job": job.id})
            if job.request["do"] == "fit":
                job.cancel()
        timer = threading.Timer(_GRACE_SECONDS, self._kill_if_running, args=(job,))
        timer.daemon = True
        timer.start()

    def close(self) -> None:
        """End the process and cancel all jobs that are not over."""
        with self._lock:
            for job in self._jobs:
                job.cancel()
            self._jobs.clear()
            self._verdicts.clear()
            self._is_closed = True
            process = self._process
            if process is not None:
                process.terminate()
        if process is not None:
            try:
                process.wait(_END_SECONDS)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            _kill_workers(process)
            remove_worker_scratch()

    def _start(self) -> subprocess.Popen[str]:
        folder = temporary_folder()
        errors = TemporaryFile("w+", encoding="utf-8", dir=folder)  # noqa: SIM115 read at its end
        process = subprocess.Popen(
            [sys.executable, "-m", "plateviz.solving.solver_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            encoding="utf-8",
            # Ctrl-C, or a notebook's interrupt, must reach only the process that waits for a job.
            start_new_session=True,
        )
        if self._niceness:
            _give_way(process.pid, self._niceness)
        self._process = process
        threading.Thread(target=self._listen, args=(process, errors), daemon=True).start()
        return process

    def _send(self, request: Mapping[str, object]) -> None:
        """Send a request to the process; start a new process if the last one has ended."""
        process = self._process or self._start()
        if process.stdin is not None:
            # If the process dies now, its listener reports it.
            with contextlib.suppress(BrokenPipeError):
                process.stdin.write(json.dumps(request) + "\n")
                process.stdin.flush()

    def _listen(self, process: subprocess.Popen[str], errors: IO[str]) -> None:
        if process.stdout is not None:
            for line in process.stdout:
                self._handle(json.loads(line))
        process.wait()
        with errors:
            errors.seek(0)
            last_line = errors.read().strip().splitlines()[-1:] or ["no message"]
        with self._lock:
            self._process = None
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    # It may hold a request that the process did not read before it died.
                    with contextlib.suppress(BrokenPipeError):
                        stream.close()
            if self._jobs:
                reason = f"the solver process ended (exit {process.returncode}): {last_line[0]}"
                self._jobs[0].fail(reason)
                self._start_next_job()

    def _handle(self, event: dict) -> None:
        with self._lock:
            if event["event"] == "ready" or not self._jobs or self._jobs[0].id != event["job"]:
                return
            self._jobs[0].take(event)
            # A job that was cancelled is over before its process has ended it.
            if event["event"] != "progress":
                self._times.note(self._jobs[0])
                self._start_next_job()

    def _start_next_job(self) -> None:
        """Remove the first job and start the next one, after the verdicts that come before it."""
        self._jobs.popleft()
        waiting, self._verdicts = self._verdicts, []
        for last, request in waiting:
            if last in self._jobs:
                self._verdicts.append((last, request))
            else:
                self._send(request)
        if self._jobs:
            self._send(self._jobs[0].request)

    def _kill_if_running(self, job: Job) -> None:
        with self._lock:
            if self._jobs and self._jobs[0] is job and self._process is not None:
                job.cancel()
                self._process.kill()


def _give_way(process: int, niceness: int) -> None:
    """Let a process, and all that it starts, give way to others."""
    if hasattr(os, "setpriority"):
        os.setpriority(os.PRIO_PROCESS, process, os.getpriority(os.PRIO_PROCESS, 0) + niceness)
    # Linux may divide the cores among sessions first, and the process has a session of its own.
    with contextlib.suppress(OSError):
        Path(f"/proc/{process}/autogroup").write_text(str(niceness), encoding="ascii")


def _kill_workers(ended: subprocess.Popen[str]) -> None:
    """End what a process that has ended started, and what may still write: they are its group."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(ended.pid, signal.SIGKILL)
