"""Refused requests: what no page of the dashboard asks for, refused without a traceback."""

import time
from typing import Any

from bokeh.server.urls import per_app_patterns
from bokeh.util.token import check_token_signature, get_token_payload
from panel.io.server import WSHandler
from tornado.web import Application, HTTPError, RequestHandler

# Opening a websocket with something that is no token of this server raises one of these.
_NO_TOKEN = (ValueError, TypeError, KeyError, AttributeError, AssertionError, RecursionError)


class CheckedWebsocket(WSHandler):
    """A websocket that is opened only with a token that this server signed and that is valid.

    Bokeh checks both as well, but after opening, and logs a traceback.
    """

    async def prepare(self) -> None:
        """Refuse the request with status 403 unless it has such a token."""
        await super().prepare()
        if not self._finished and not self._has_token():
            self.set_status(403)
            self.finish("expected a websocket of an open page, found no valid token\n")

    def _has_token(self) -> bool:
        words = self.request.headers.get("Sec-WebSocket-Protocol", "").split(",")
        token = words[-1].strip()
        own: Any = self.application
        try:
            # The payload is decompressed, so the signature is checked before it.
            return bool(
                check_token_signature(token, secret_key=own.secret_key, signed=own.sign_sessions)
                and get_token_payload(token)["session_expiry"] > time.time()
            )
        except _NO_TOKEN:
            return False


class RefusedPath(RequestHandler):
    """A path that no file can have: status 404."""

    def prepare(self) -> None:
        """Refuse the request."""
        raise HTTPError(404)


def check_websockets() -> None:
    """Let servers that are made from now on check the tokens of websockets."""
    for place, (route, handler, *_) in enumerate(per_app_patterns):
        if handler is WSHandler:
            per_app_patterns[place] = (route, CheckedWebsocket)


def refuse_paths(application: Application) -> None:
    """Let a server refuse paths with a NUL character, which raise in the system's functions."""
    application.add_handlers(r".*", [(r"/.*%00.*", RefusedPath)])
