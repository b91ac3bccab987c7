"""Columns that are kept: made once, forgotten in order, and never changed."""

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from plateviz.runs.column_cache import ColumnCache
from solver.errors import InputError


def column(value, made=None):
    """Return what makes an array of 100 bytes, and records that it has."""

    def make():
        if made is not None:
            made.append(value)
        return (np.full(100, value, dtype=np.int8),)

    return make


def test_arrays_are_made_once():
    kept, made = ColumnCache(), []
    first = kept.arrays("a", column(1, made))
    assert kept.arrays("a", column(2, made)) is first
    assert made == [1]
    assert kept.size == 100


def test_arrays_asked_for_the_longest_ago_are_forgotten_first():
    kept, made = ColumnCache(limit=250), []
    for key in ("a", "b", "a", "c"):
        kept.arrays(key, column(key == "b", made))
    assert kept.size == 200
    kept.arrays("a", column(3, made))
    assert made == [False, True, False]
    kept.arrays("b", column(4, made))
    assert made[-1] == 4


def test_arrays_larger_than_the_limit_are_returned_and_not_kept():
    kept = ColumnCache(limit=50)
    assert kept.arrays("a", column(7))[0][0] == 7
    assert kept.size == 0


def test_arrays_cannot_be_changed():
    (values,) = ColumnCache().arrays("a", column(1))
    with pytest.raises(ValueError, match="read-only"):
        values[0] = 2


def test_failure_is_raised_and_not_kept():
    kept = ColumnCache()

    def fail():
        raise InputError("damaged")

    with pytest.raises(InputError, match="damaged"):
        kept.arrays("a", fail)
    assert kept.arrays("a", column(5))[0][0] == 5


def test_two_threads_make_the_same_arrays_once_and_do_not_wait_for_others():
    kept, made, go_on = ColumnCache(), [], threading.Event()

    def slow():
        made.append("slow")
        go_on.wait(30)
        return column(1)()

    with ThreadPoolExecutor(2) as pool:
        waiting = [pool.submit(kept.arrays, "a", slow) for _ in range(2)]
        assert kept.arrays("b", column(2))[0][0] == 2
        assert not any(one.done() for one in waiting)
        go_on.set()
        assert waiting[0].result() is waiting[1].result()
    assert made == ["slow"]
