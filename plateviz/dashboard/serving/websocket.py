"""The websocket of a page: opened with a valid token and within the limits, and then limited."""

import contextlib
import time
from typing import Any

import panel as pn
from bokeh.io import doc as bokeh_io_doc
from bokeh.protocol.exceptions import ProtocolError
from bokeh.protocol.message import Message
from bokeh.server.urls import per_app_patterns
from bokeh.util.token import check_token_signature, get_session_id, get_token_payload
from panel.io.server import WSHandler

from plateviz.dashboard.serving.limits import TOO_MANY_OPENED, Limits

LIMITS = "plateviz_limits"
"""Name of the setting of a server's Tornado application that has its `Limits`."""

# The documents in which the process is at the moment. It has no public name.
_PATCHED_DOCUMENTS: Any = bokeh_io_doc._PATCHED_CURDOCS  # noqa: SLF001
# The documents that Panel takes for connected, of which it drops no change. It has no public name.
_CONNECTED: Any = pn.state._connected  # noqa: SLF001
# Opening a websocket with something that is no token of this server raises one of these.
_NO_TOKEN = (ValueError, TypeError, KeyError, AttributeError, AssertionError, RecursionError)
# A part that is no JSON, or not what it should be, raises one of these, which Bokeh logs.
_NO_MESSAGE = (ValueError, TypeError, KeyError, AttributeError, RecursionError)
# Status codes of RFC 6455: the browser has left the page, by closing it or loading another one;
# what was sent is against the rules of the server.
_LEFT, _AGAINST_THE_RULES = 1001, 1008
# Messages of a page that the server could not carry out. A page may be changed while it sends one.
_MOST_ERRORS = 20


class CheckedWebsocket(WSHandler):
    """A websocket that is opened only with a token that this server signed and that is valid.

    Bokeh checks both as well, but after opening, and logs a traceback.
    """

    _client: str | None = None
    _is_counted = _is_closing = False
    _errors = 0

    async def prepare(self) -> None:
        """Refuse the request unless it has such a token, and one page more may be open."""
        await super().prepare()
        if self._finished:
            return
        if not self._has_token():
            self.set_status(403)
            self.finish("expected a websocket of an open page, found no valid token\n")
            return
        limits = self._limits
        if limits is None:
            return
        self._client = limits.client_of(self.request)
        if reason := limits.pages.reason(self._client):
            self.set_status(503)
            self.finish(f"{reason}\n")
        elif not (self._has_session() or limits.may_open(self._client)):
            self.set_status(429)
            self.finish(f"{TOO_MANY_OPENED}\n")

    def open(self, *arguments: str, **named: str) -> None:
        """Count the page, and let its messages out at once."""
        limits = self._limits
        if limits is not None:
            limits.pages.enter(self._client or "")
            self._is_counted = True
        # A message is several small packets. The network would keep back each one until the browser
        # has acknowledged the one before, for which it may take 40 ms.
        self.set_nodelay(True)
        super().open(*arguments, **named)

    def on_close(self) -> None:
        """Count the page as closed; end its session soon, unless the page may come back to it."""
        limits = self._limits
        if limits is not None and self._is_counted:
            self._is_counted = False
            limits.pages.leave(self._client or "")
        # A connection that was lost, by a network that failed, has no status code.
        if self.close_code == _LEFT and self.connection is not None:
            self.connection.session.request_expiration()
        super().on_close()

    async def on_message(self, fragment: str | bytes) -> None:
        """Handle a part of a message, unless the client has sent too many."""
        limits = self._limits
        if self._is_closing:
            return
        if limits is not None and self._client and not limits.messages.allows(self._client):
            self.close(_AGAINST_THE_RULES, "too many messages")
            return
        await super().on_message(fragment)

    def close(self, code: int | None = None, reason: str | None = None) -> None:
        """Close the connection; what has arrived and was not handled yet is not."""
        self._is_closing = True
        super().close(code, reason)

    async def _receive(self, fragment: str | bytes) -> Message | None:
        # A page waits until it is told that its session is there.
        if self.receiver is not None:
            with contextlib.suppress(*_NO_MESSAGE):
                return await super()._receive(fragment)
        self.close(_AGAINST_THE_RULES, "a message that is wrong")
        return None

    async def _schedule(self, work: Any) -> None:  # noqa: ANN401 as Bokeh
        if isinstance(work, Message) and work.msgtype == "ERROR":
            # Bokeh 3.9 forgets to leave the document in which an error was raised.
            if isinstance(_PATCHED_DOCUMENTS, list):
                _PATCHED_DOCUMENTS.clear()
            self._errors += 1
            if self._errors > _MOST_ERRORS:
                self.close(_AGAINST_THE_RULES, "too many messages that were wrong")
                return
        await super()._schedule(work)
        if isinstance(work, Message) and work.msgtype == "PULL-DOC-REPLY" and self.connection:
            # Panel knows that a page is connected once it is drawn. What a person does before, as
            # soon as a button is there, would be answered with changes that it drops.
            _CONNECTED[self.connection.session.document] = True

    async def _async_open(self, token: str) -> None:
        # The session is made here, and its links have to start from the page.
        prefix = self.application.prefix  # type: ignore[attr-defined]
        self.request.path = f"{prefix}/"
        self.request.uri = f"{prefix}/?{self.request.query}"
        await super()._async_open(token)

    @property
    def _limits(self) -> Limits | None:
        """The limits of the server; another server of this process has none."""
        return self.application.settings.get(LIMITS)

    @property
    def _offered_token(self) -> str:
        return self.request.headers.get("Sec-WebSocket-Protocol", "").split(",")[-1].strip()

    def _has_token(self) -> bool:
        return is_valid_token(self._offered_token, self.application)

    def _has_session(self) -> bool:
        """Whether the page has asked for its session already, or had one."""
        try:
            self.application_context.get_session(get_session_id(self._offered_token))
        except ProtocolError:
            return False
        return True


def is_valid_token(token: str, application: Any) -> bool:  # noqa: ANN401 of Bokeh
    """Return whether the server of `application` has signed a token, which is still valid."""
    key = {"secret_key": application.secret_key, "signed": application.sign_sessions}
    try:
        # The payload is decompressed, so the signature is checked before it.
        return bool(
            check_token_signature(token, **key)
            and get_token_payload(token)["session_expiry"] > time.time()
        )
    except _NO_TOKEN:
        return False


def check_websockets() -> None:
    """Let servers that are made from now on check their websockets."""
    for place, (route, handler, *_) in enumerate(per_app_patterns):
        if handler is WSHandler:
            per_app_patterns[place] = (route, CheckedWebsocket)
