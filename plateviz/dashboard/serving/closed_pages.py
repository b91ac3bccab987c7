"""Closed pages: filters for what the server's libraries log about pages that were closed.

A page that is closed while it is drawn has messages in transit in both directions. Tornado and
Bokeh log a traceback for each of them, hundreds of lines for one closed tab.
"""

import logging

from bokeh.server.connection import ServerConnection
from tornado.iostream import StreamClosedError
from tornado.websocket import WebSocketClosedError

_LOGGERS = ("asyncio", "tornado.application", "bokeh.server.protocol_handler")
_SENDER = "bokeh.server.views.ws"
_SESSION_OF = ServerConnection.session.fget.__code__  # type: ignore[attr-defined]


def silence_closed_pages() -> None:
    """Suppress log messages about closed pages; other messages are still logged."""
    for name in _LOGGERS:
        logging.getLogger(name).addFilter(_is_other_error)
    # This logger warns of messages that it cannot send, without an exception to check.
    logging.getLogger(_SENDER).addFilter(_is_other_warning)


def _is_other_error(record: logging.LogRecord) -> bool:
    error = record.exc_info[1] if record.exc_info else None
    return not (
        isinstance(error, WebSocketClosedError | StreamClosedError) or _is_lost_session(error)
    )


def _is_lost_session(error: BaseException | None) -> bool:
    """Return whether an error is Bokeh's assertion that a connection still has its session."""
    frame = error.__traceback__ if isinstance(error, AssertionError) else None
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    return frame is not None and frame.tb_frame.f_code is _SESSION_OF


def _is_other_warning(record: logging.LogRecord) -> bool:
    return "connection was closed" not in record.getMessage()
