"""Threads that tell who waits when something is done."""

import gc
import threading

import pytest

from plateviz.solving.background import Background


class Page:
    """Counts how often it is called."""

    def __init__(self):
        self.calls, self.is_called = 0, threading.Event()

    def call(self):
        self.calls += 1
        self.is_called.set()


@pytest.fixture
def background():
    made = Background()
    yield made
    made.shutdown()


def test_who_listens_is_called_once_when_something_is_done(background):
    page, go_on = Page(), threading.Event()
    # A page listens again and again while it waits for something else.
    for _ in range(3):
        background.listen(page.call)
    answer = background.submit(lambda one, *, two: go_on.wait(10) and one + two, 1, two=2)
    assert page.calls == 0
    go_on.set()
    assert answer.result(10) == 3
    assert page.is_called.wait(10)
    background.submit(int).result(10)
    assert page.calls == 1


def test_what_fails_is_done_too(background):
    page = Page()
    background.listen(page.call)
    with pytest.raises(ZeroDivisionError):
        background.submit(lambda: 1 / 0).result(10)
    assert page.is_called.wait(10)


def test_page_that_is_gone_is_not_kept(background):
    page = Page()
    background.listen(page.call)
    del page
    gc.collect()
    assert background.submit(int).result(10) == 0
