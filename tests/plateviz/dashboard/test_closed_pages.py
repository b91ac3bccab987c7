"""What a server leaves unsaid of pages that were closed, and what it must not."""

import logging

import pytest
from bokeh.server.connection import ServerConnection
from tornado.iostream import StreamClosedError
from tornado.websocket import WebSocketClosedError

from plateviz.dashboard.closed_pages import leave_unsaid

_OF_MESSAGES = logging.getLogger("bokeh.server.protocol_handler")
_OF_SENDING = logging.getLogger("bokeh.server.views.ws")


@pytest.fixture(autouse=True)
def unsaid():
    loggers = [logging.getLogger(name) for name in ("asyncio", "tornado.application")]
    before = {logger: list(logger.filters) for logger in (*loggers, _OF_MESSAGES, _OF_SENDING)}
    leave_unsaid()
    yield
    for logger, filters in before.items():
        logger.filters[:] = filters


def fail_with(error):
    raise error


def ask_for_a_lost_session():
    connection = object.__new__(ServerConnection)
    connection._session = None
    return connection.session


@pytest.mark.parametrize(
    ("logger", "fault"),
    [
        ("bokeh.server.protocol_handler", ask_for_a_lost_session),
        ("tornado.application", ask_for_a_lost_session),
        ("asyncio", lambda: fail_with(WebSocketClosedError())),
        ("asyncio", lambda: fail_with(StreamClosedError())),
    ],
)
def test_a_page_that_was_closed_is_no_fault(logger, fault, caplog):
    try:
        fault()
    except (AssertionError, WebSocketClosedError, StreamClosedError):
        logging.getLogger(logger).error("error handling message", exc_info=True)
    assert caplog.text == ""


@pytest.mark.parametrize("error", [AssertionError("of ours"), ValueError("of ours")])
@pytest.mark.parametrize(
    "logger", ["asyncio", "tornado.application", "bokeh.server.protocol_handler"]
)
def test_a_fault_is_said(logger, error, caplog):
    try:
        fail_with(error)
    except (AssertionError, ValueError):
        logging.getLogger(logger).exception("error handling message")
    assert "of ours" in caplog.text


def test_a_message_that_was_not_sent_is_not_said(caplog):
    _OF_SENDING.warning("Failed sending message as connection was closed")
    assert caplog.text == ""


def test_a_refused_origin_is_said(caplog):
    _OF_SENDING.error("Refusing websocket connection from Origin 'http://a.example'")
    assert "Refusing" in caplog.text
