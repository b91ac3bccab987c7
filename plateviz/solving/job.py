"""Job: one request to the solver process, with its status and progress."""

import math
import threading
import time
import uuid
import weakref
from collections.abc import Callable, Mapping
from enum import Enum

from solver.errors import CancelledError, FitError, InputError


class JobStatus(Enum):
    """Status of a job; the value is the text shown to users."""

    QUEUED = "waiting"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def is_over(self) -> bool:
        """Whether the job has ended."""
        return self in (JobStatus.DONE, JobStatus.FAILED, JobStatus.CANCELLED)


class Job:
    """One request, with its status and progress; readable from any thread.

    A job belongs to the server, not to a browser session: sessions that request the same work
    share one job, and it continues when a page is closed. It is stopped once nobody holds it who
    has not given it up.
    """

    def __init__(self, request: Mapping[str, object]) -> None:
        """Set the request, as in `plateviz.solving.solver_process` but without the job's id."""
        self.id = uuid.uuid4().hex
        self.request = {**request, "job": self.id}
        self._changed = threading.Condition()
        self._status = JobStatus.QUEUED
        self._message = ""
        self._is_input_error = False
        self._progress: list[Mapping[str, object]] = []
        self._listeners: list[weakref.WeakMethod[Callable[[], object]]] = []
        self._holders = 0
        self._forecast: Callable[[], str] = lambda: ""
        self._started = time.monotonic()
        self._begun: float | None = None
        self._first_step: tuple[int, float] | None = None
        self._ended: float | None = None

    @property
    def status(self) -> JobStatus:
        """Current status."""
        return self._status

    @property
    def message(self) -> str:
        """Reason of a failure; empty otherwise."""
        return self._message

    @property
    def progress(self) -> list[Mapping[str, object]]:
        """Progress events so far."""
        return list(self._progress)

    @property
    def first_step(self) -> tuple[int, float] | None:
        """Number of the first step that was told, and the seconds until then; None before it."""
        return self._first_step

    @property
    def progress_text(self) -> str:
        """How far the job is, in words."""
        forecast = self._forecast()
        if self._status is JobStatus.QUEUED:
            return forecast or "waiting for the solver"
        last = self._progress[-1] if self._progress else {}
        text = str(last.get("stage", "starting"))
        step = last.get("largest_step")
        # The start of a fit has no step.
        if isinstance(step, float) and math.isfinite(step):
            text += f", largest step {step:.2g} sigma"
        return f"{text} ({self.seconds:.0f} s{forecast})"

    @property
    def seconds(self) -> float:
        """Seconds from the request to the end, or to now."""
        return (self._ended or time.monotonic()) - self._started

    @property
    def seconds_running(self) -> float:
        """Seconds since the job was begun, without those before; 0 if it was not."""
        return 0.0 if self._begun is None else (self._ended or time.monotonic()) - self._begun

    def hold(self) -> None:
        """Count one more who waits for the job."""
        with self._changed:
            self._holders += 1

    def release(self) -> bool:
        """Count one less; return whether nobody is left."""
        with self._changed:
            self._holders = max(self._holders - 1, 0)
            return self._holders == 0

    def tell_by(self, forecast: Callable[[], str]) -> None:
        """Take the function that tells in words how long the job waits, or still runs."""
        self._forecast = forecast

    def take(self, event: Mapping[str, object]) -> None:
        """Handle an event of the solver process."""
        kind = event["event"]
        if kind == "progress":
            self._advance(JobStatus.RUNNING, event)
        elif kind == "failed":
            self.fail(str(event["message"]), bool(event.get("is_input_error", False)))
        else:
            self._advance(JobStatus(kind))

    def fail(self, message: str, is_input_error: bool = False) -> None:
        """Mark the job as failed, because of its input or for another reason."""
        with self._changed:
            if not self._status.is_over:
                self._message, self._is_input_error = message, is_input_error
            self._advance(JobStatus.FAILED)

    def cancel(self) -> None:
        """Mark the job as cancelled."""
        self._advance(JobStatus.CANCELLED)

    def require_done(self) -> None:
        """Raise the error of a job that did not succeed.

        Raises
        ------
        InputError, FitError
            If it failed because of its input, or for another reason.
        CancelledError
            If it was cancelled.
        """
        if self._status is JobStatus.FAILED:
            raise (InputError if self._is_input_error else FitError)(self._message)
        if self._status is not JobStatus.DONE:
            raise CancelledError("the job was stopped; nothing was changed")

    def watch(self, listener: Callable[[], object]) -> None:
        """Call a method from another thread once the job is over, or now if it is.

        The job does not keep the method's object alive, such as a page that has been closed.
        """
        with self._changed:
            if not self._status.is_over:
                self._listeners.append(weakref.WeakMethod(listener))
                return
        listener()

    def wait(self, timeout: float | None = None) -> JobStatus:
        """Wait until the job is over, for `timeout` seconds at most."""
        with self._changed:
            self._changed.wait_for(lambda: self._status.is_over, timeout)
        return self._status

    def wait_for_news(self, seen: int, timeout: float) -> None:
        """Wait for more than `seen` progress events or the end, for `timeout` seconds at most."""
        with self._changed:
            self._changed.wait_for(
                lambda: self._status.is_over or len(self._progress) > seen, timeout
            )

    def _advance(self, status: JobStatus, event: Mapping[str, object] | None = None) -> None:
        listeners = []
        with self._changed:
            # A job that is over does not change: a killed process may still send events.
            if not self._status.is_over:
                self._status = status
                if status is JobStatus.RUNNING and self._begun is None:
                    self._begun = time.monotonic()
                if event is not None:
                    self._progress.append(event)
                    step = event.get("iteration")
                    if isinstance(step, int) and self._first_step is None:
                        self._first_step = step, self.seconds_running
                if status.is_over:
                    self._ended = time.monotonic()
                    listeners, self._listeners = self._listeners, []
            self._changed.notify_all()
        for reference in listeners:
            if (listener := reference()) is not None:
                listener()
