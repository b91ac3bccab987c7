"""Traffic: how long a server has had no requests, and no answers on their way."""

import time
from weakref import WeakSet

from tornado.httputil import HTTPServerRequest
from tornado.iostream import IOStream


class Traffic:
    """The traffic of one server."""

    def __init__(self) -> None:
        """Begin without requests."""
        self._latest = 0.0
        self._streams: WeakSet[IOStream] = WeakSet()

    def note(self, request: HTTPServerRequest) -> None:
        """Take a request into account that has come."""
        self._latest = time.monotonic()
        stream = getattr(request.connection, "stream", None)
        if stream is not None:
            self._streams.add(stream)

    @property
    def quiet_seconds(self) -> float:
        """Seconds since the last request, or since an answer was last seen on its way."""
        now = time.monotonic()
        if any(stream.writing() for stream in self._streams):
            self._latest = now
        return now - self._latest
