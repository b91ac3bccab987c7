"""LatestAnswer: another thread makes what takes a while, and only the latest request counts."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from enum import Enum
from typing import Generic, NamedTuple, TypeVar

Value = TypeVar("Value")


class Pending(Enum):
    """Stands for an answer that is being made."""

    PENDING = "ask again later"


PENDING = Pending.PENDING


class _Request(NamedTuple, Generic[Value]):
    key: object
    answer: Future[Value]


class LatestAnswer(Generic[Value]):
    """Answers requests of one figure, which asks again and again until there is an answer.

    A figure has one request with the executor at a time. While it is being answered, the ones
    after it replace each other, and its answer is discarded if it is no longer asked for.
    """

    def __init__(self, executor: Executor | None) -> None:
        """Begin without a request.

        Parameters
        ----------
        executor : makes the answers; None to make each at once
        """
        self._executor = executor
        self._last: _Request[Value] | None = None

    def answer(self, key: object, make: Callable[[], Value]) -> Value | Pending:
        """Return the answer to a request, or `PENDING` until there is one.

        Parameters
        ----------
        key : equal for equal requests
        make : makes the answer; what it raises is raised
        """
        if self._executor is None:
            return make()
        if self._last is None or (self._last.key != key and self._last.answer.done()):
            self._last = _Request(key, self._executor.submit(make))
        if self._last.key == key and self._last.answer.done():
            return self._last.answer.result()
        return PENDING
