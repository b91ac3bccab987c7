"""Refused requests: what no page of the dashboard asks for, refused without a traceback."""

from typing import Any

from tornado.httputil import HTTPServerRequest
from tornado.routing import Matcher, Rule
from tornado.web import Application, HTTPError, RequestHandler

from plateviz.dashboard.serving.limits import Limits


class RefusedPath(RequestHandler):
    """A path that no file can have: status 404."""

    def prepare(self) -> None:
        """Refuse the request."""
        raise HTTPError(404)


class TooManyRequests(RequestHandler):
    """A request of a client that has sent too many: status 429."""

    def prepare(self) -> None:
        """Refuse the request, and close the connection that it came by."""
        self.set_status(429)
        self.set_header("Retry-After", "1")
        self.set_header("Connection", "close")
        self.finish("too many requests from this address; try again in a second\n")

    def _log(self) -> None:
        """Log nothing: a flood would fill the log with as many lines."""


class _TooMany(Matcher):
    """Matches the requests of clients that have sent too many."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        self._limits.traffic.note(request)
        return None if self._limits.may_ask(self._limits.client_of(request)) else {}


def refuse_floods(application: Application, limits: Limits) -> None:
    """Let a server refuse what clients ask for beyond `limits`, before anything else is done."""
    application.default_router.rules.insert(0, Rule(_TooMany(limits), TooManyRequests))


def refuse_paths(application: Application) -> None:
    """Let a server refuse paths with a NUL character, which raise in the system's functions."""
    application.add_handlers(r".*", [(r"/.*%00.*", RefusedPath)])
