"""Job: one piece of work of the solver process, as everybody who waits for it sees it."""

import threading
import time
import uuid
from collections.abc import Mapping
from enum import Enum

from solver.errors import CancelledError, FitError, InputError


class JobStatus(Enum):
    """Where a job stands; the value is the word for people."""

    QUEUED = "waiting"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def is_over(self) -> bool:
        """Whether nothing more will happen."""
        return self in (JobStatus.DONE, JobStatus.FAILED, JobStatus.CANCELLED)


class Job:
    """One request and what has become of it.

    It belongs to the server, not to a browser session: whoever asks for the same work
    watches the same job, and it goes on when a page is closed. Read from any thread.
    """

    def __init__(self, request: Mapping[str, object]) -> None:
        """Take the request, without the job's id, as `plateviz.solving.solver_process` reads it."""
        self.id = uuid.uuid4().hex
        self.request = {**request, "job": self.id}
        self._changed = threading.Condition()
        self._status = JobStatus.QUEUED
        self._message = ""
        self._is_input_error = False
        self._progress: list[Mapping[str, object]] = []
        self._started = time.monotonic()
        self._ended: float | None = None

    @property
    def status(self) -> JobStatus:
        """Where the job stands."""
        return self._status

    @property
    def message(self) -> str:
        """Why it failed; empty otherwise."""
        return self._message

    @property
    def progress(self) -> list[Mapping[str, object]]:
        """What it has reported so far."""
        return list(self._progress)

    @property
    def seconds(self) -> float:
        """Time since it was asked for, until it was over."""
        return (self._ended or time.monotonic()) - self._started

    def take(self, event: Mapping[str, object]) -> None:
        """Take in an event of the solver process."""
        kind = event["event"]
        if kind == "progress":
            self._advance(JobStatus.RUNNING, event)
        elif kind == "failed":
            self.fail(str(event["message"]), bool(event.get("is_input_error", False)))
        else:
            self._advance(JobStatus(kind))

    def fail(self, message: str, is_input_error: bool = False) -> None:
        """Mark the job as failed, and say whether it was for what it was given."""
        with self._changed:
            if not self._status.is_over:
                self._message, self._is_input_error = message, is_input_error
            self._advance(JobStatus.FAILED)

    def cancel(self) -> None:
        """Mark the job as cancelled."""
        self._advance(JobStatus.CANCELLED)

    def require_done(self) -> None:
        """Raise what ended a job that is over before its end.

        Raises
        ------
        InputError, FitError
            If it failed, for its input or otherwise.
        CancelledError
            If it was cancelled.
        """
        if self._status is JobStatus.FAILED:
            raise (InputError if self._is_input_error else FitError)(self._message)
        if self._status is not JobStatus.DONE:
            raise CancelledError("the work was stopped; nothing was changed")

    def wait(self, timeout: float | None = None) -> JobStatus:
        """Wait until the job is over, or for `timeout` seconds."""
        with self._changed:
            self._changed.wait_for(lambda: self._status.is_over, timeout)
        return self._status

    def wait_for_news(self, seen: int, timeout: float) -> None:
        """Wait until there are more than `seen` reports, or the job is over."""
        with self._changed:
            self._changed.wait_for(
                lambda: self._status.is_over or len(self._progress) > seen, timeout
            )

    def _advance(self, status: JobStatus, event: Mapping[str, object] | None = None) -> None:
        with self._changed:
            # What is over stays over: a late report of a killed process changes nothing.
            if not self._status.is_over:
                self._status = status
                if event is not None:
                    self._progress.append(event)
                if status.is_over:
                    self._ended = time.monotonic()
            self._changed.notify_all()
