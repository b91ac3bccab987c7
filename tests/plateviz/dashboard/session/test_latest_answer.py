"""Answers made by another thread: the latest request counts, and others are discarded."""

from concurrent.futures import Future

import pytest

from plateviz.dashboard.session.latest_answer import PENDING, LatestAnswer
from solver.errors import InputError


class Executor:
    """An executor whose work is done when a test says so."""

    def __init__(self):
        self.waiting = []

    def submit(self, make):
        future = Future()
        self.waiting.append((future, make))
        return future

    def work(self):
        future, make = self.waiting.pop(0)
        try:
            future.set_result(make())
        except InputError as error:
            future.set_exception(error)


@pytest.fixture
def executor():
    return Executor()


@pytest.fixture
def latest(executor):
    return LatestAnswer(executor)


def test_answer_is_pending_until_it_is_made_once(latest, executor):
    made = []
    ask = lambda: latest.answer("a", lambda: made.append(1) or "answer")  # noqa: E731
    assert ask() is PENDING
    assert ask() is PENDING
    executor.work()
    assert (ask(), ask()) == ("answer", "answer")
    assert made == [1]
    assert executor.waiting == []


def test_requests_that_are_overtaken_are_never_made(latest, executor):
    made = []
    for key in "abc":
        assert latest.answer(key, lambda key=key: made.append(key) or key) is PENDING
    executor.work()
    assert latest.answer("c", lambda: made.append("c") or "c") is PENDING
    executor.work()
    assert latest.answer("c", str) == "c"
    assert made == ["a", "c"]


def test_failure_is_raised_for_its_request_only(latest, executor):
    def fail():
        raise InputError("damaged")

    latest.answer("a", fail)
    executor.work()
    with pytest.raises(InputError, match="damaged"):
        latest.answer("a", fail)
    assert latest.answer("b", lambda: 2) is PENDING
    executor.work()
    assert latest.answer("b", str) == 2


def test_without_an_executor_every_answer_is_made_at_once():
    assert LatestAnswer(None).answer("a", lambda: 3) == 3
