"""Jobs: progress and status, which do not change once a job is over."""

import threading
import weakref

import pytest

from plateviz.solving.job import Job, JobStatus
from solver.errors import CancelledError, FitError, InputError


def test_job_keeps_its_progress():
    job = Job({"do": "fit"})
    assert job.status is JobStatus.QUEUED
    job.take({"event": "progress", "stage": "reading"})
    assert job.status is JobStatus.RUNNING
    job.take({"event": "progress", "stage": "iteration 1"})
    job.take({"event": "done"})
    assert job.status is JobStatus.DONE
    assert [report["stage"] for report in job.progress] == ["reading", "iteration 1"]


@pytest.mark.parametrize(
    ("event", "status"),
    [("done", JobStatus.DONE), ("cancelled", JobStatus.CANCELLED), ("failed", JobStatus.FAILED)],
)
def test_job_that_is_over_does_not_change(event, status):
    job = Job({"do": "fit"})
    job.take({"event": event, "message": "because"})
    job.take({"event": "progress", "stage": "too late"})
    job.cancel()
    assert job.status is status
    assert job.progress == []
    assert job.message == ("because" if event == "failed" else "")


def test_cancelled_job_does_not_fail_when_its_process_ends():
    job = Job({"do": "fit"})
    job.cancel()
    job.fail("the solver process ended")
    assert (job.status, job.message) == (JobStatus.CANCELLED, "")


def test_seconds_stop_at_the_end():
    job = Job({"do": "fit"})
    job.take({"event": "done"})
    assert job.seconds == job.seconds


def test_waiting_ends_when_another_thread_ends_the_job():
    job = Job({"do": "fit"})
    threading.Timer(0.05, job.cancel).start()
    assert job.wait(timeout=10) is JobStatus.CANCELLED


def test_request_has_the_unique_id_of_the_job():
    first, second = Job({"do": "fit"}), Job({"do": "fit"})
    assert first.id != second.id
    assert first.request == {"do": "fit", "job": first.id}


@pytest.mark.parametrize(
    ("event", "error", "message"),
    [
        ({"event": "failed", "message": "bad", "is_input_error": True}, InputError, "bad"),
        ({"event": "failed", "message": "open", "is_input_error": False}, FitError, "open"),
        ({"event": "cancelled"}, CancelledError, "stopped"),
    ],
    ids=["input", "fit", "cancelled"],
)
def test_job_without_success_raises_its_error(event, error, message):
    job = Job({"do": "fit"})
    job.take(event)
    with pytest.raises(error, match=message):
        job.require_done()


def test_job_with_success_raises_nothing():
    job = Job({"do": "fit"})
    job.take({"event": "done"})
    job.require_done()


class Page:
    """Counts how often a job has called."""

    def __init__(self):
        self.calls = 0

    def call(self):
        self.calls += 1


def test_job_calls_once_when_it_is_over():
    job, page, late = Job({"do": "fit"}), Page(), Page()
    job.watch(page.call)
    job.take({"event": "progress", "stage": "reading"})
    assert page.calls == 0
    job.take({"event": "done"})
    job.cancel()
    assert page.calls == 1
    job.watch(late.call)
    assert late.calls == 1


def test_job_does_not_keep_a_page_that_is_gone():
    job, page = Job({"do": "fit"}), Page()
    gone = weakref.ref(page)
    job.watch(page.call)
    del page
    assert gone() is None
    job.cancel()
