"""What the solver process does while it is idle, which gives way to requests."""

import queue
import threading
from functools import partial
from pathlib import Path

import pytest

from plateviz.solving import solver_process
from plateviz.solving.fitters import Fitters
from plateviz.solving.origin import SurveyFolder, origin_to_dict
from plateviz.solving.preparation import Preparation
from plateviz.solving.put_off import PutOff
from plateviz.solving.solver_process import (
    _Cancellations,
    _hear,
    _Heard,
    _Kept,
    _next_request,
    _serve,
)
from solver.errors import CancelledError, InputError
from solver.runtime.interruption import give_way

ONE = Path("result")


@pytest.fixture
def requests():
    return queue.Queue()


def test_waiting_request_is_served_before_preparations(requests):
    done = []
    requests.put({"job": "1"})
    put_off = PutOff()
    put_off.add_eigenmodes(lambda: done.append("eigenmodes"))
    prepared = Preparation(*((done.append(step) for step in range(3)) for _ in range(2)))
    assert _next_request(requests, prepared, put_off) == {"job": "1"}
    assert done == []


def test_request_waits_for_one_step_at_most(requests):
    done = []

    def steps():
        for step in range(3):
            done.append(step)
            if step == 1:
                requests.put({"job": "2"})
            yield

    put_off = PutOff()
    put_off.add_eigenmodes(lambda: done.append("eigenmodes"))
    assert _next_request(requests, Preparation(later=steps()), put_off) == {"job": "2"}
    assert done == ["eigenmodes", 0, 1]


def test_request_interrupts_what_gives_way_to_it(requests):
    """What was interrupted is done when there is time again."""
    done, put_off = [], PutOff()

    def eigenmodes():
        done.append("begun")
        if len(done) == 1:
            requests.put({"job": "1"})
        give_way()
        done.append("eigenmodes")
        requests.put({"job": "2"})

    put_off.add_eigenmodes(eigenmodes)
    assert _next_request(requests, Preparation(), put_off) == {"job": "1"}
    assert done == ["begun"]
    assert _next_request(requests, Preparation(), put_off) == {"job": "2"}
    assert done == ["begun", "begun", "eigenmodes"]


def test_likely_what_ifs_are_made_before_what_takes_longer(requests):
    done, put_off = [], PutOff()
    put_off.add_eigenmodes(lambda: done.append("eigenmodes"))
    put_off.add_verdict(ONE, lambda: done.append("verdict"))

    def later():
        done.append("orders")
        requests.put(None)
        yield

    soon = (done.append("what-if") for _ in range(1))
    assert _next_request(requests, Preparation(soon, later()), put_off) is None
    assert done == ["verdict", "what-if", "eigenmodes", "orders"]


def test_what_is_urgent_begins_at_once(requests, monkeypatch):
    monkeypatch.setattr(solver_process, "_NEXT_S", 60.0)
    soon = (requests.put({"job": "1"}) for _ in range(1))
    assert _next_request(requests, Preparation(soon, is_urgent=True), PutOff()) == {"job": "1"}


def test_what_is_paused_begins_later_but_a_verdict_does_not(requests, monkeypatch):
    monkeypatch.setattr(solver_process, "_NEXT_S", 0.0)
    done, put_off = [], PutOff()
    put_off.add_verdict(ONE, lambda: done.append("verdict"))
    soon = (done.append("what-if") for _ in range(1))
    threading.Timer(0.05, requests.put, [{"job": "1"}]).start()
    assert _next_request(requests, Preparation(soon).paused(60.0), put_off) == {"job": "1"}
    assert done == ["verdict"]


def test_preparations_are_finished_without_requests(requests):
    done = []

    def steps():
        for step in range(3):
            done.append(step)
            yield
        requests.put(None)

    assert _next_request(requests, Preparation(later=steps()), PutOff()) is None
    assert done == [0, 1, 2]


def test_verdict_is_next_and_eigenmodes_are_when_idle(requests, monkeypatch):
    done, put_off = [], PutOff()
    put_off.add_eigenmodes(lambda: done.append("eigenmodes"))
    put_off.add_verdict(ONE, lambda: done.append("verdict"))
    # The server sends the next request once it has heard that the one before is done.
    monkeypatch.setattr(solver_process, "_NEXT_S", 20.0)
    threading.Timer(0.02, requests.put, [{"job": "1"}]).start()
    _next_request(requests, Preparation(), put_off)
    assert done == []
    monkeypatch.setattr(solver_process, "_NEXT_S", 0.0)
    put_off.add_verdict(Path("another"), lambda: requests.put({"job": "2"}))
    _next_request(requests, Preparation(), put_off)
    assert done == ["verdict"]


def test_few_results_wait():
    """The oldest are given up until somebody asks; the latest is the one that is looked at."""
    done, put_off = [], PutOff()
    for number in range(4):
        work = partial(done.append, f"verdict {number}")
        put_off.add_verdict(Path(f"result {number}"), work)
        put_off.add_eigenmodes(partial(done.append, f"eigenmodes {number}"))
    put_off.limit()
    assert done == []
    put_off.finish_verdict(Path("result 0"))
    put_off.finish_verdict(Path("result 2"))
    put_off.finish()
    put_off.finish()
    assert done[:3] == ["verdict 2", "verdict 3", "verdict 1"]
    assert done[3:] == ["eigenmodes 2", "eigenmodes 3"]


def test_what_cannot_be_written_ends_nothing(requests):
    def full():
        raise InputError("the disk is full")

    put_off = PutOff()
    put_off.add_verdict(ONE, full)
    put_off.add_eigenmodes(lambda: requests.put({"job": "1"}))
    assert _next_request(requests, Preparation(), put_off) == {"job": "1"}


def test_as_many_orbits_are_kept_as_there_is_room_for(small_survey):
    origin = origin_to_dict(SurveyFolder(str(small_survey)))
    requests = [{"origin": origin, "orbit": orbit} for orbit in (0, 1, 0)]
    two, one = Fitters(most=2), Fitters(most=1)
    first, _, again = map(two.of, requests)
    assert again is first
    first, _, again = map(one.of, requests)
    assert again is not first


class Moments:
    """Moments that are asked for and waited for."""

    def __init__(self):
        self.asked = self.waited = 0

    def ask(self):
        self.asked += 1

    def wait(self, check):
        check()
        self.waited += 1


@pytest.mark.parametrize(
    ("do", "engine", "waited"),
    [("fit", "svi", 2), ("fit", "nuts", 2), ("fit", "gauss-newton", 0), ("survey", "svi", 0)],
)
def test_long_fit_waits_for_who_asks_for_something_quick(monkeypatch, do, engine, waited):
    def work(request, progress, kept):
        progress(stage="a block of steps")
        give_way()
        return Preparation()

    monkeypatch.setitem(solver_process._WORK, do, work)
    heard, said = _Heard(_Cancellations(), Moments()), []
    request = {"do": do, "job": "1", "settings": {"engine": engine}}
    _serve(request, said.append, heard, _Kept(Fitters(), PutOff()))
    assert heard.moments.waited == waited
    assert [event["event"] for event in said] == ["progress", "done"]


def test_fit_is_cancelled_while_it_waits(monkeypatch):
    monkeypatch.setitem(solver_process._WORK, "fit", lambda request, progress, kept: progress())
    heard, said = _Heard(_Cancellations(), Moments()), []
    monkeypatch.setattr(
        heard.moments, "wait", lambda check: (heard.cancellations.add("1"), check())
    )
    request = {"do": "fit", "job": "1", "settings": {"engine": "svi"}}
    _serve(request, said.append, heard, _Kept(Fitters(), PutOff()))
    assert [event["event"] for event in said] == ["progress", "cancelled"]


def test_what_is_said_to_a_process_at_work_is_heard_at_once(requests):
    heard = _Heard(_Cancellations(), Moments())
    _hear({"do": "pause", "seconds": 1.0}, requests, heard)
    _hear({"do": "cancel", "job": "1"}, requests, heard)
    assert heard.moments.asked == 1
    with pytest.raises(CancelledError):
        heard.cancellations.check("1")
    assert [requests.get_nowait() for _ in range(requests.qsize())] == [
        {"do": "pause", "seconds": 1.0}
    ]
