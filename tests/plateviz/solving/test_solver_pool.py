"""Several solver processes: which of them runs a job, and what a waiting job is told."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from plateviz.solving.forecast import JobTimes, is_long
from plateviz.solving.job import Job
from plateviz.solving.solver_pool import SolverPool
from plateviz.solving.solver_queue import SolverQueue, _give_way
from plateviz.tables.counts import duration_text
from solver.data.settings import FitSettings


class FakeQueue(SolverQueue):
    """A queue without a process."""

    def _start(self):
        self.sent, self._process = [], None

    def _send(self, request):
        self.sent.append(request["do"])

    def finish(self):
        self._handle({"event": "done", "job": self._jobs[0].id})


@pytest.fixture
def queues():
    return []


@pytest.fixture
def pool(queues):
    return made_pool(queues, 2)


def made_pool(queues, most):
    def start(**options):
        queues.append(FakeQueue(**options))
        return queues[-1]

    return SolverPool(most, start)


def fit(orbit, engine="gauss-newton", what_if=False):
    settings = FitSettings(engine=engine).to_dict()
    request = {"do": "fit", "origin": "sky", "orbit": orbit, "settings": settings}
    return Job({**request, "what_if": what_if})


def test_what_if_does_not_wait_for_a_long_fit(pool, queues):
    long = pool.submit(fit(0, "svi"))
    assert [queue.jobs for queue in queues] == [[], [long]]
    quick = pool.submit(fit(0, what_if=True))
    assert queues[0].jobs == [quick]


def test_long_fits_wait_for_each_other(pool, queues):
    jobs = [pool.submit(fit(orbit, engine)) for orbit, engine in enumerate(("svi", "nuts", "svi"))]
    assert [queue.jobs for queue in queues] == [[], jobs]


def test_what_ifs_have_a_second_process_beside_that_of_long_fits(queues):
    pool = made_pool(queues, 3)
    long = [pool.submit(fit(0, "svi")), pool.submit(fit(1, "svi"))]
    quick = [pool.submit(fit(orbit, what_if=True)) for orbit in range(6)]
    assert [queue.jobs for queue in queues] == [quick[:4], long, quick[4:]]
    assert queues[0]._niceness == queues[2]._niceness < queues[1]._niceness


def test_half_of_many_processes_run_long_fits(queues):
    pool = made_pool(queues, 5)
    long = [pool.submit(fit(orbit, "svi")) for orbit in range(3)]
    assert [queue.jobs for queue in queues] == [[], [long[0], long[2]], [long[1]]]


def test_second_process_is_started_only_when_many_wait(pool, queues):
    for orbit in range(4):
        pool.submit(fit(orbit))
    assert len(queues) == 1
    fifth = pool.submit(fit(4))
    assert queues[1].jobs == [fifth]


def test_what_if_goes_where_its_orbit_was_fitted(pool, queues):
    for orbit in range(5):
        pool.submit(fit(orbit))
    queues[1].finish()
    what_if = pool.submit(fit(4, what_if=True))
    assert queues[1].jobs == [what_if]
    queues[1].finish()
    pool.submit(fit(9, "nuts"))
    assert pool.submit(fit(4, what_if=True)) in queues[0].jobs


def test_preparations_go_where_the_what_ifs_will(pool, queues):
    pool.submit(fit(0, "svi"))
    pool.prepare({"origin": "sky", "orbit": 3})
    queues[0]._process = object()
    pool.pause()
    pool.rest()
    assert queues[0].sent == ["prepare", "pause", "rest"]
    assert pool.submit(fit(3, what_if=True)) in queues[0].jobs


def test_what_was_put_off_is_asked_of_the_process_that_put_it_off(pool, queues):
    what_if = pool.submit(fit(0, what_if=True))
    pool.submit(fit(0, "svi"))
    assert pool.complete(what_if, "verdict")
    assert (queues[0].sent[-1], queues[1].sent[-1]) == ("complete", "fit")
    assert not pool.complete(fit(1, what_if=True), "verdict")
    pool.close()
    assert not pool.complete(what_if, "verdict")


def test_what_was_put_off_of_a_prepared_what_if_is_asked_of_the_process_of_its_orbit(pool, queues):
    pool.submit(fit(0))
    pool.prepare({"origin": "sky", "orbit": 0})
    assert pool.complete(fit(0, what_if=True), "eigenmodes")
    assert queues[0].sent[-1] == "complete"


def test_one_process_does_everything_in_order(queues):
    pool = made_pool(queues, 1)
    jobs = [pool.submit(fit(0, "svi")), pool.submit(fit(0, what_if=True))]
    assert queues[0].jobs == jobs
    pool.cancel(jobs[1])
    assert queues[0].jobs == jobs[:1]


def test_waiting_job_tells_its_place_and_when_it_begins(pool, queues, monkeypatch):
    first, second, third = [pool.submit(fit(orbit, "svi")) for orbit in range(3)]
    assert "2 fits before it" in third.progress_text
    assert "begins" not in third.progress_text
    svi = FitSettings().svi
    total = svi.steps + svi.patience
    # It compiles for a minute, which says nothing of its steps.
    for step, seconds in ((total // 10, 60.0), (total // 5, 70.0)):
        monkeypatch.setattr(Job, "seconds_running", seconds)
        first.take({"event": "progress", "stage": f"step {step}", "iteration": step})
        assert ("begins" in second.progress_text) == (seconds > 60.0)
    assert second.progress_text == ("waiting for the solver, 1 fit before it, begins in about 80 s")
    assert ", about 80 s left)" in first.progress_text
    queues[1].finish()
    assert third.progress_text == ("waiting for the solver, 1 fit before it, begins in about 1 s")


def test_time_left_is_that_of_earlier_jobs_of_the_kind(monkeypatch):
    times = JobTimes()
    assert times.left(fit(0)) is None
    for seconds in (1.0, 2.0, 9.0):
        monkeypatch.setattr(Job, "seconds_running", seconds)
        job = fit(0)
        job.take({"event": "done"})
        times.note(job)
    monkeypatch.setattr(Job, "seconds_running", 0.5)
    assert times.left(fit(1)) == 1.5
    assert times.left(fit(1, what_if=True)) is None
    failed = fit(0, what_if=True)
    failed.fail("because")
    times.note(failed)
    assert times.left(fit(1, what_if=True)) is None


@pytest.mark.parametrize(
    ("seconds", "words"), [(0.2, "1 s"), (80.4, "80 s"), (400.0, "7 min"), (9000.0, "2.5 h")]
)
def test_times_are_rough(seconds, words):
    assert duration_text(seconds) == words


def test_survey_and_slow_engines_are_long():
    assert is_long({"do": "survey"})
    assert [is_long(fit(0, engine).request) for engine in ("gauss-newton", "svi", "nuts")] == [
        False,
        True,
        True,
    ]


@pytest.mark.skipif(not Path("/proc/self/autogroup").is_file(), reason="needs groups of sessions")
def test_process_of_long_fits_gives_way_to_those_of_other_sessions():
    program = [sys.executable, "-c", "input()"]
    with subprocess.Popen(program, stdin=subprocess.PIPE, start_new_session=True) as process:
        _give_way(process.pid, 10)
        own = os.getpriority(os.PRIO_PROCESS, 0)
        assert os.getpriority(os.PRIO_PROCESS, process.pid) == min(own + 10, 19)
        group = Path(f"/proc/{process.pid}/autogroup").read_text(encoding="ascii")
        assert group.split()[1:] == ["nice", "10"]
        process.communicate(b"\n")
