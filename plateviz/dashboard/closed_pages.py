"""Closed pages: what the server's libraries log of a browser that went away is left unsaid.

A page that is closed while it is being drawn has messages under way in both directions. Tornado
and Bokeh log a traceback for each of them, hundreds of lines for a tab that somebody closed.
"""

import logging

from bokeh.server.connection import ServerConnection
from tornado.iostream import StreamClosedError
from tornado.websocket import WebSocketClosedError

_LOGGERS = ("asyncio", "tornado.application", "bokeh.server.protocol_handler")
_SENDER = "bokeh.server.views.ws"
_SESSION_OF = ServerConnection.session.fget.__code__  # type: ignore[attr-defined]


def leave_unsaid() -> None:
    """Have nothing logged of pages that were closed; what else is logged stays."""
    for name in _LOGGERS:
        logging.getLogger(name).addFilter(_is_of_a_fault)
    # It warns of what it cannot send, with no exception to tell by.
    logging.getLogger(_SENDER).addFilter(_is_no_lost_message)


def _is_of_a_fault(record: logging.LogRecord) -> bool:
    error = record.exc_info[1] if record.exc_info else None
    return not (isinstance(error, WebSocketClosedError | StreamClosedError) or _has_lost(error))


def _has_lost(error: BaseException | None) -> bool:
    """Return whether that is Bokeh's assertion that a connection still has its session."""
    frame = error.__traceback__ if isinstance(error, AssertionError) else None
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    return frame is not None and frame.tb_frame.f_code is _SESSION_OF


def _is_no_lost_message(record: logging.LogRecord) -> bool:
    return "connection was closed" not in record.getMessage()
