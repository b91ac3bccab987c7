"""The ticker of a page asks for what is being made: often at first, seldom if it takes long."""

import asyncio
from concurrent.futures import ThreadPoolExecutor

import pytest
from bokeh.document import Document
from panel.io.state import set_curdoc

from plateviz.dashboard import ticker
from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.ticker import PageTicker
from plateviz.dashboard.views.pages.pages import Pages
from tests.plateviz.dashboard.fake_survey import SurveyStore

SOON, SELDOM = ticker._PENDING_MILLISECONDS, ticker._PROGRESS_MILLISECONDS


@pytest.fixture
def waits(fit_result, monkeypatch):
    """The waits before each of a number of ticks, while a verdict is to come."""
    asked = []
    monkeypatch.setattr(
        Document, "add_timeout_callback", lambda _, work, wait: asked.append((work, wait))
    )
    navigation = Navigation(Session(SurveyStore(fit_result, [])))
    monkeypatch.setattr(navigation.session.judging, "look", lambda: None)
    navigation.session.judging.is_any_pending = True
    document = Document()

    async def begin():
        with set_curdoc(document):
            return PageTicker(navigation, Pages(navigation, id))

    # The loop of a browser's tests may run in this one.
    with ThreadPoolExecutor(1) as thread:
        page = thread.submit(lambda: asyncio.run(begin())).result()

    def tick(count, change=lambda _: None):
        change(page)
        asked.clear()
        for _ in range(count):
            page._tick()
        return [wait for _, wait in asked]

    return tick


def test_what_takes_long_is_asked_for_seldom(waits):
    found = waits(ticker._MOST_SOON + 3)
    assert found == ticker._MOST_SOON * [SOON] + 3 * [SELDOM]


def test_what_has_just_changed_is_asked_for_often_again(waits):
    waits(ticker._MOST_SOON + 1)
    assert waits(2) == 2 * [SELDOM]
    assert waits(2, PageTicker.wake) == 2 * [SOON]
