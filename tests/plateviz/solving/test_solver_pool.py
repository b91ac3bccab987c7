"""Several solver processes: which of them runs a job, and what a waiting job is told."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from plateviz.runs.scratch_result import EIGENMODES, VERDICT
from plateviz.solving import solver_pool
from plateviz.solving.forecast import JobTimes, is_long
from plateviz.solving.job import Job
from plateviz.solving.solver_pool import SolverPool
from plateviz.solving.solver_queue import SolverQueue, _give_way
from plateviz.tables.counts import duration_text
from solver.data.settings import FitSettings


class FakeQueue(SolverQueue):
    """A queue without a process."""

    def _start(self):
        self.sent, self.pauses, self._process = [], [], None

    def _send(self, request):
        self.sent.append("only fit" if request.get("only_fit") else request["do"])
        if request["do"] == "pause":
            self.pauses.append(request["seconds"])

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


def fit(orbit, engine="gauss-newton", what_if=False, base=None):
    settings = FitSettings(engine=engine).to_dict()
    request = {"do": "fit", "origin": "sky", "orbit": orbit, "settings": settings}
    return Job({**request, "what_if": what_if, "base": base})


def from_run(orbit):
    """A what-if that any process can begin, with the solution of a run."""
    return fit(orbit, what_if=True, base={"settings": {}, "directory": "run"})


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


def test_second_process_gets_ready_as_soon_as_one_waits_that_it_could_serve(queues):
    pool = made_pool(queues, 3)
    first, second = pool.submit(from_run(0)), pool.submit(from_run(0))
    assert queues[0].jobs == [first, second]
    (getting_ready,) = queues[1].jobs
    assert getting_ready.request["do"] == "get ready"
    assert getting_ready.request["base"] == second.request["base"]
    assert not is_long(getting_ready.request)
    queues[1].finish()
    assert pool.submit(from_run(1)) in queues[1].jobs
    assert len(queues) == 2


def test_one_person_has_one_process(queues):
    pool = made_pool(queues, 3)
    for _ in range(3):
        what_if = pool.submit(from_run(0))
        # A new what-if takes the place of one that nobody waits for any more.
        pool.cancel(what_if)
    assert len(queues) == 1


def test_what_if_of_a_run_goes_elsewhere_if_many_wait_where_its_orbit_is_ready(queues):
    pool = made_pool(queues, 3)
    of_orbit = [pool.submit(from_run(0)) for _ in range(3)]
    queues[1].finish()
    assert queues[0].jobs == of_orbit
    elsewhere = pool.submit(from_run(0))
    assert queues[1].jobs == [elsewhere]
    queues[1].finish()
    # The orbit is ready there now.
    assert pool.submit(from_run(0)) in queues[1].jobs


def test_what_if_without_a_run_waits_where_its_orbit_was_fitted(queues):
    pool = made_pool(queues, 3)
    jobs = [pool.submit(fit(0, what_if=True)) for _ in range(6)]
    assert [queue.jobs for queue in queues] == [jobs]


def test_orbit_is_only_fitted_beside_what_others_ask_for(queues, monkeypatch):
    monkeypatch.setattr(solver_pool, "time", SimpleNamespace(monotonic=lambda: now[0]))
    now = [0.0]
    pool = made_pool(queues, 3)
    pool.submit(from_run(0))
    pool.submit(from_run(0))
    queues[1].finish()
    for queue in queues:
        queue._process, queue.sent = object(), []
    pool.prepare({"origin": "sky", "orbit": 1})
    assert pool.submit(from_run(2)) in queues[1].jobs
    assert [queue.sent for queue in queues] == [["only fit", "pause"], ["fit"]]
    now[0] = 60.0
    pool.prepare({"origin": "sky", "orbit": 1})
    assert queues[0].sent[2:] == ["prepare"]
    pool.submit(from_run(1))
    pool.prepare({"origin": "sky", "orbit": 1})
    assert queues[0].sent[3:] == ["prepare"]


def test_long_fit_stops_no_preparations(pool, queues):
    queues[0]._process = object()
    pool.submit(fit(0, "svi"))
    assert queues[0].sent == []


def test_verdict_follows_the_jobs_that_wait_but_eigenmodes_do_not(pool, queues):
    judged = pool.submit(fit(0, what_if=True))
    queues[0].finish()
    for _ in range(2):
        pool.submit(fit(0, what_if=True))
    assert pool.complete(judged, VERDICT)
    later = pool.submit(fit(0, what_if=True))
    pool.complete(judged, EIGENMODES)
    assert queues[0].sent == ["fit", "fit", "complete"]
    queues[0].finish()
    assert queues[0].sent[3:] == ["fit"]
    queues[0].finish()
    assert queues[0].sent[4:] == ["complete", "fit"]
    assert queues[0].jobs == [later]


def test_verdict_does_not_wait_for_a_job_that_is_cancelled(pool, queues):
    judged = pool.submit(fit(0, what_if=True))
    waiting = pool.submit(fit(0, what_if=True))
    pool.complete(judged, VERDICT)
    pool.cancel(waiting)
    queues[0].finish()
    assert queues[0].sent == ["fit", "complete"]


def test_preparations_go_where_the_what_ifs_will(pool, queues):
    pool.submit(fit(0, "svi"))
    pool.prepare({"origin": "sky", "orbit": 3})
    for queue in queues:
        queue._process = object()
    pool.pause()
    pool.rest()
    assert queues[0].sent == ["prepare", "pause", "rest"]
    pool.submit(fit(4, what_if=True))
    # For longer while a page opens than while another process answers.
    opens, answers = queues[1].pauses
    assert opens > answers
    assert pool.submit(fit(3, what_if=True)) in queues[0].jobs


def test_what_was_put_off_is_asked_of_the_process_that_put_it_off(pool, queues):
    what_if = pool.submit(fit(0, what_if=True))
    queues[0].finish()
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
