"""Work that nobody waits for gives way to other work, and is done later."""

import pytest

from solver.errors import CancelledError
from solver.runtime.interruption import attempts, give_way, interruptible


def refuse():
    raise CancelledError("a request waits")


def test_work_goes_on_unless_something_waits():
    give_way()
    with interruptible(refuse), pytest.raises(CancelledError):
        give_way()
    give_way()


def test_the_innermost_check_holds():
    with interruptible(refuse):
        with interruptible(lambda: None):
            give_way()
        with pytest.raises(CancelledError):
            give_way()


def test_interrupted_step_is_begun_anew():
    begun = []

    def step():
        begun.append(1)
        if len(begun) < 3:
            refuse()

    assert len(list(attempts(step))) == 3
    assert len(begun) == 3


def test_step_with_nothing_to_do_is_no_attempt():
    assert list(attempts(lambda: False)) == []
    assert len(list(attempts(lambda: True))) == 1


def test_step_that_fails_is_not_tried_again():
    def step():
        raise ValueError("no solution")

    with pytest.raises(ValueError, match="no solution"):
        list(attempts(step))
