"""Log messages about closed pages are suppressed; other messages are not."""

import logging

import pytest
from bokeh.server.connection import ServerConnection
from tornado.iostream import StreamClosedError
from tornado.websocket import WebSocketClosedError

from plateviz.dashboard.serving.closed_pages import silence_closed_pages

_OF_MESSAGES = logging.getLogger("bokeh.server.protocol_handler")
_OF_SENDING = logging.getLogger("bokeh.server.views.ws")


@pytest.fixture(autouse=True)
def filters():
    loggers = [logging.getLogger(name) for name in ("asyncio", "tornado.application")]
    before = {logger: list(logger.filters) for logger in (*loggers, _OF_MESSAGES, _OF_SENDING)}
    silence_closed_pages()
    yield
    for logger, found in before.items():
        logger.filters[:] = found


def fail_with(error):
    raise error


def use_a_lost_session():
    connection = object.__new__(ServerConnection)
    connection._session = None
    return connection.session


@pytest.mark.parametrize(
    ("logger", "fail"),
    [
        ("bokeh.server.protocol_handler", use_a_lost_session),
        ("tornado.application", use_a_lost_session),
        ("asyncio", lambda: fail_with(WebSocketClosedError())),
        ("asyncio", lambda: fail_with(StreamClosedError())),
    ],
)
def test_error_of_a_closed_page_is_not_logged(logger, fail, caplog):
    try:
        fail()
    except (AssertionError, WebSocketClosedError, StreamClosedError):
        logging.getLogger(logger).error("error handling message", exc_info=True)
    assert caplog.text == ""


@pytest.mark.parametrize("error", [AssertionError("another error"), ValueError("another error")])
@pytest.mark.parametrize(
    "logger", ["asyncio", "tornado.application", "bokeh.server.protocol_handler"]
)
def test_other_error_is_logged(logger, error, caplog):
    try:
        fail_with(error)
    except (AssertionError, ValueError):
        logging.getLogger(logger).exception("error handling message")
    assert "another error" in caplog.text


def test_message_that_was_not_sent_is_not_logged(caplog):
    _OF_SENDING.warning("Failed sending message as connection was closed")
    assert caplog.text == ""


def test_refused_origin_is_logged(caplog):
    _OF_SENDING.error("Refusing websocket connection from Origin 'http://a.example'")
    assert "Refusing" in caplog.text
