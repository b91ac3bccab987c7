"""The solver process between requests: what may be asked next is made ready, unless asked."""

import queue

import pytest

from plateviz.solving.solver_process import _next


@pytest.fixture
def requests():
    return queue.Queue()


def test_a_request_that_waits_is_served_first(requests):
    made = []
    requests.put({"job": "1"})
    assert _next(requests, (made.append(step) for step in range(3))) == {"job": "1"}
    assert made == []


def test_a_request_waits_for_one_step_at_most(requests):
    made = []

    def later():
        for step in range(3):
            made.append(step)
            if step == 1:
                requests.put({"job": "2"})
            yield

    assert _next(requests, later()) == {"job": "2"}
    assert made == [0, 1]


def test_everything_is_made_ready_while_nobody_asks(requests):
    made = []

    def later():
        for step in range(3):
            made.append(step)
            yield
        requests.put(None)

    assert _next(requests, later()) is None
    assert made == [0, 1, 2]
