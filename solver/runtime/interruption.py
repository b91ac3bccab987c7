"""Interruption: work that nobody waits for gives way to other work while it goes on.

Long loops call `give_way` at each step. It does nothing, unless who began the work has said when
it is to be interrupted.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar

from solver.errors import CancelledError

Check = Callable[[], object]
"""Returns if the work may go on, and raises an exception, such as `CancelledError`, if not."""


def _go_on() -> None:
    """Let the work go on."""


_CHECK: ContextVar[Check] = ContextVar("check", default=_go_on)


@contextmanager
def interruptible(check: Check) -> Iterator[None]:
    """Let a check end the work of this thread within the context."""
    before = _CHECK.set(check)
    try:
        yield
    finally:
        _CHECK.reset(before)


def give_way() -> None:
    """Raise the exception of the check if other work waits."""
    _CHECK.get()()


def attempts(step: Callable[[], bool | None]) -> Iterator[None]:
    """Try a step until it is not interrupted by a `CancelledError`; yield after each attempt.

    Parameters
    ----------
    step : returns False if it had nothing to do
    """
    is_over = False
    while not is_over:
        did_something: bool | None = True
        with suppress(CancelledError):
            did_something = step()
            is_over = True
        if did_something is not False:
            yield
