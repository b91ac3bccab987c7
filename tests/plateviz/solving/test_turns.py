"""Turns: one after the other, in order, and each told its place."""

import threading
import time

import pytest

from plateviz.solving.turns import Turns


def until(holds):
    deadline = time.monotonic() + 10.0
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.002)


def test_threads_work_one_after_the_other_in_order_and_know_their_place():
    turns, places, done = Turns(), {}, []
    may_end = [threading.Event() for _ in range(3)]

    def work(number):
        with turns.turn(places.setdefault(number, []).append):
            assert may_end[number].wait(10.0)
            done.append(number)

    threads = []
    for number in range(3):
        threads.append(threading.Thread(target=work, args=(number,)))
        threads[-1].start()
        until(lambda n=number: len(turns._queue) == n + 1)
    until(lambda: places == {0: [], 1: [1], 2: [2]})
    # The last one is ready first.
    may_end[2].set()
    may_end[0].set()
    until(lambda: places[2] == [2, 1])
    assert done == [0]
    may_end[1].set()
    for thread in threads:
        thread.join(10.0)
    assert done == [0, 1, 2]
    assert places == {0: [], 1: [1], 2: [2, 1]}


def test_work_that_fails_leaves_its_turn_to_the_next():
    turns = Turns()
    with pytest.raises(ZeroDivisionError), turns.turn(print):
        raise ZeroDivisionError
    with turns.turn(pytest.fail):
        pass
