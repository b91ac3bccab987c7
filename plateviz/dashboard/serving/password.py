"""Password: what other machines need to open the dashboard."""

import asyncio
import ipaddress
import re
import secrets
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bokeh.server.auth_provider import AuthProvider, User
from tornado.web import RequestHandler

from solver.errors import InputError

# Too many to be guessed through a network.
_SHORTEST = 12
_LARGEST_BYTES = 1024
# Tornado looks for templates beside this file.
_PAGE = "login.html"
_USER, _COOKIE = "plateviz", "plateviz-login"
_DELAY_SECONDS = 1.0
# A second slash, or a backslash, would begin the name of another host.
_OWN_PATH = re.compile(r"/(?![/\\])[^\s\\]*\Z")


def read_password(path: Path) -> str:
    """Return the password in a file: its only line, without blanks at the ends.

    Raises
    ------
    InputError
        If the file cannot be read, or holds no password of at least 12 characters.
    """
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST_BYTES).decode("utf-8").strip()
    except (OSError, ValueError) as error:
        raise InputError(f"--password-file: expected a text file, found {path}: {error}") from error
    if len(content) < _SHORTEST or len(content.splitlines()) > 1:
        raise InputError(
            f"{path}: expected one line with a password of at least {_SHORTEST} characters"
        )
    return content


def require_password(address: str, password: str | None, is_open: bool) -> None:
    """Refuse to serve other machines without a password, unless that is wanted.

    Parameters
    ----------
    address : of the interface to serve on
    is_open : whether everybody who reaches the port may open the page

    Raises
    ------
    InputError
        If the address is not a loopback address, and neither a password nor `is_open` is given.
    """
    if password is not None and is_open:
        raise InputError("--no-password: expected it without --password-file, found both")
    if password is None and not is_open and not _is_loopback(address):
        raise InputError(
            f"--address {address}: expected a password, since everybody who reaches this address "
            "could open the page and start fits, found none; give --password-file FILE, or "
            "--no-password if that is what you want"
        )


class PasswordLogin(AuthProvider):
    """The login of a server that asks for one password; Bokeh calls its properties.

    Who gave the password has a cookie that this server signed, until the browser is closed.
    """

    def __init__(self, password: str) -> None:
        """Take the password."""
        self.password = password
        super().__init__()

    @property
    def get_user(self) -> Callable[[Any], User | None]:
        """Function from a request's handler to its user; None before the password is given."""
        return lambda handler: User(_USER) if handler.get_signed_cookie(_COOKIE) else None

    @property
    def login_url(self) -> str:
        """Path of the login page."""
        return "/login"

    @property
    def login_handler(self) -> type[RequestHandler]:
        """Handler of the login page."""
        return _LoginPage


class _LoginPage(RequestHandler):
    def get(self) -> None:
        self._ask(is_wrong=False)

    async def post(self) -> None:
        given = self.get_body_argument("password", "", strip=True)
        password = self.application.auth_provider.password  # type: ignore[attr-defined]
        if not secrets.compare_digest(given.encode(), password.encode()):
            await asyncio.sleep(_DELAY_SECONDS)
            self.set_status(403)
            self._ask(is_wrong=True)
            return
        self.set_signed_cookie(
            _COOKIE, _USER, expires_days=None, httponly=True, samesite="Lax", path=self._root()
        )
        self.redirect(self._next())

    def _ask(self, is_wrong: bool) -> None:
        self.set_header("Cache-Control", "no-store")
        self.render(_PAGE, is_wrong=is_wrong, next=self._next())

    def _next(self) -> str:
        """Return the path to go on to, which is one of this server."""
        path = self.get_argument("next", "")
        return path if _OWN_PATH.match(path) else self._root()

    def _root(self) -> str:
        return f"{self.application.prefix}/"  # type: ignore[attr-defined]


def _is_loopback(address: str) -> bool:
    try:
        found = socket.getaddrinfo(address, None)
    except (OSError, UnicodeError):
        return False
    return all(ipaddress.ip_address(one[4][0]).is_loopback for one in found)
