"""Speculative work of the solver process, which gives way to requests."""

import queue

import pytest

from plateviz.solving.solver_process import _next_request


@pytest.fixture
def requests():
    return queue.Queue()


def test_waiting_request_is_served_before_speculative_work(requests):
    done = []
    requests.put({"job": "1"})
    assert _next_request(requests, (done.append(step) for step in range(3))) == {"job": "1"}
    assert done == []


def test_request_waits_for_one_step_at_most(requests):
    done = []

    def speculative():
        for step in range(3):
            done.append(step)
            if step == 1:
                requests.put({"job": "2"})
            yield

    assert _next_request(requests, speculative()) == {"job": "2"}
    assert done == [0, 1]


def test_speculative_work_is_finished_without_requests(requests):
    done = []

    def speculative():
        for step in range(3):
            done.append(step)
            yield
        requests.put(None)

    assert _next_request(requests, speculative()) is None
    assert done == [0, 1, 2]
