"""Limits: how much one client may ask of the server, and how many pages are open at once.

A client is an address on the network. Behind a reverse proxy on this machine it is the address that
the proxy states; where it states none, the pages of all clients are counted together.
"""

import time
from collections import Counter
from collections.abc import Callable
from ipaddress import ip_address
from typing import NamedTuple

from tornado.httputil import HTTPServerRequest

from plateviz.dashboard.serving.traffic import Traffic

_STATED = "X-Real-IP"
# Addresses remembered; those that may ask for everything again are forgotten first.
_MOST_REMEMBERED = 10_000


class Rate(NamedTuple):
    """How often something may happen: so often at once, and so often a second after that."""

    at_once: int
    per_second: float


# Twenty people of one address may open a page, which loads some sixty files, at the same moment.
REQUESTS = Rate(at_once=3000, per_second=200)
# Parts of messages, three or more for each; a slider that is dragged sends sixty messages a second.
MESSAGES = Rate(at_once=6000, per_second=600)
# A session takes a second of the server's time to make, and ten MB of its memory for a while.
OPENINGS = Rate(at_once=60, per_second=1)
TOO_MANY_OPENED = "too many pages opened from this address; try again in a minute"


class RateLimit:
    """What each client may still ask for."""

    def __init__(self, rate: Rate, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin with clients that may ask for all at once.

        Parameters
        ----------
        clock : returns a time in seconds
        """
        self._rate, self._clock = rate, clock
        self._left: dict[str, tuple[float, float]] = {}

    def allows(self, client: str) -> bool:
        """Count something that a client asks for; return whether it may have it."""
        now = self._clock()
        left = self._left_of(client, now) - 1.0
        if len(self._left) >= _MOST_REMEMBERED:
            self._forget(now)
        self._left[client] = max(left, 0.0), now
        return left >= 0.0

    def _left_of(self, client: str, now: float) -> float:
        left, then = self._left.get(client, (float(self._rate.at_once), now))
        return min(left + (now - then) * self._rate.per_second, float(self._rate.at_once))

    def _forget(self, now: float) -> None:
        full = self._rate.at_once
        self._left = {
            client: left for client, left in self._left.items() if self._left_of(client, now) < full
        }
        if len(self._left) >= _MOST_REMEMBERED:
            self._left.clear()


class PageLimit:
    """How many pages are open, in all and for each client."""

    def __init__(self, in_all: int, per_client: int) -> None:
        """Set the most pages that may be open at once."""
        self.in_all, self.per_client = in_all, per_client
        self._open: Counter[str] = Counter()

    def enter(self, client: str) -> None:
        """Count a page that has been opened."""
        self._open[client] += 1

    def leave(self, client: str) -> None:
        """Count a page that has been closed."""
        self._open[client] -= 1
        if self._open[client] <= 0:
            del self._open[client]

    def reason(self, client: str | None) -> str:
        """Return why a client cannot open another page; empty if it can.

        Parameters
        ----------
        client : None if it is not known
        """
        if self._open.total() >= self.in_all:
            return f"This server shows {self.in_all} pages at once, and all of them are open."
        if client is not None and self._open[client] >= self.per_client:
            return (
                f"This server shows {self.per_client} pages at once to one address, "
                "and all of yours are open."
            )
        return ""


class Limits:
    """The limits of one server.

    Attributes
    ----------
    traffic : requests and their answers
    """

    def __init__(self, pages: PageLimit, is_proxied: bool = False) -> None:
        """Begin without clients.

        Parameters
        ----------
        is_proxied : whether browsers reach the server through a reverse proxy
        """
        self.pages = pages
        self.requests, self.messages = RateLimit(REQUESTS), RateLimit(MESSAGES)
        self.openings = RateLimit(OPENINGS)
        self.traffic = Traffic()
        self._is_proxied = is_proxied

    def may_ask(self, client: str | None) -> bool:
        """Count a request of a client; return whether it is to be answered."""
        return client is None or self.requests.allows(client)

    def may_open(self, client: str | None) -> bool:
        """Count a session that a client asks for; return whether it may have it."""
        return client is None or self.openings.allows(client)

    def client_of(self, request: HTTPServerRequest) -> str | None:
        """Return the address of a client; None if only its proxy knows it."""
        peer = request.remote_ip or ""
        if not self._is_proxied or not _is_loopback(peer):
            return peer
        return request.headers.get(_STATED)


def _is_loopback(address: str) -> bool:
    try:
        return ip_address(address).is_loopback
    except ValueError:
        return False
