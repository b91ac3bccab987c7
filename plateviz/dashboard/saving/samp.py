"""SAMP: a table is given to the programs of this machine's hub, such as TOPCAT and DS9.

The hub is found by its lock file, and only one of this machine is asked. The client of astropy
is deprecated and waits for a hub without a limit; these few calls have one.
"""

import os
import socket
from collections.abc import Mapping
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote, urlsplit
from xml.parsers.expat import ExpatError
from xmlrpc.client import Error, Fault, ServerProxy, Transport

from solver.errors import InputError

_SECONDS = 5.0
_TABLE = "table.load.votable"
# A large table takes a program some seconds to read.
_ANSWER_SECONDS = 20
_MOST_PROGRAMS = 5
# What is raised for a hub that is gone, silent or none.
_OF_A_HUB = (OSError, HTTPException, Error, ExpatError, LookupError, TypeError, ValueError)
_NO_HUB = "no SAMP hub runs on this machine; TOPCAT starts one (Interop)"


class Hub(NamedTuple):
    """A hub of this machine: where it answers, and the secret of its lock file."""

    url: str
    secret: str


class _Transport(Transport):
    """Calls that end after some seconds."""

    def __init__(self, seconds: float) -> None:
        super().__init__()
        self._seconds = seconds

    def make_connection(self, host: Any) -> HTTPConnection:  # noqa: ANN401 as the base class
        connection = super().make_connection(host)
        connection.timeout = self._seconds
        return connection


def local_hub(environment: Mapping[str, str] = os.environ) -> Hub:
    """Return the hub of the person who runs plateviz.

    Raises
    ------
    InputError
        If there is none, its lock file is damaged, or it is on another machine.
    """
    path = _lock_file(environment)
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        raise InputError(_NO_HUB) from None
    values = dict(line.strip().split("=", 1) for line in lines if "=" in line and line[0] != "#")
    url, secret = values.get("samp.hub.xmlrpc.url", ""), values.get("samp.secret", "")
    if not url or not secret:
        raise InputError(f"{path}: expected the address and the secret of a SAMP hub, found none")
    _require_here(url, path)
    return Hub(url, secret)


def send_table(path: Path, name: str, hub: Hub) -> list[str]:
    """Give a VOTable to the programs of a hub; return their names, and what they answered.

    Parameters
    ----------
    path : of the file
    name : of the table, for people

    Raises
    ------
    InputError
        If the hub does not answer, or none of its programs takes tables.
    """
    message = {
        "samp.mtype": _TABLE,
        "samp.params": {"url": path.as_uri(), "table-id": path.stem, "name": name},
    }
    try:
        with ServerProxy(hub.url, transport=_Transport(_SECONDS)) as proxy:
            calls: Any = proxy.samp.hub
            key = calls.register(hub.secret)["samp.private-key"]
            try:
                calls.declareMetadata(key, {"samp.name": "plateviz"})
                takers = list(calls.getSubscribedClients(key, _TABLE))[:_MOST_PROGRAMS]
                names = [str(calls.getMetadata(key, one).get("samp.name", one)) for one in takers]
                answers = [_answer(hub, key, one, message) for one in takers]
            finally:
                calls.unregister(key)
    except _OF_A_HUB as error:
        told = f"the SAMP hub of this machine does not answer ({type(error).__name__})"
        raise InputError(told) from error
    if not takers:
        raise InputError("no program that takes tables is connected to the SAMP hub; start TOPCAT")
    return [name + answer for name, answer in zip(names, answers, strict=True)]


def _answer(hub: Hub, key: str, program: str, message: Mapping[str, Any]) -> str:
    """Send a message to a program; return what is to be said of its answer besides its name."""
    transport = _Transport(_ANSWER_SECONDS + _SECONDS)
    with ServerProxy(hub.url, transport=transport) as proxy:
        calls: Any = proxy.samp.hub
        try:
            found = calls.callAndWait(key, program, message, str(_ANSWER_SECONDS))
        except Fault:
            return " (no answer yet)"
    if found.get("samp.status") == "samp.ok":
        return ""
    return f" (which answers: {found.get('samp.error', {}).get('samp.errortxt', 'no')})"


def _lock_file(environment: Mapping[str, str]) -> Path:
    """Return the lock file that the standard profile names."""
    given = environment.get("SAMP_HUB", "").removeprefix("std-lockurl:")
    if not given:
        return Path.home() / ".samp"
    parts = urlsplit(given)
    if parts.scheme != "file" or parts.netloc not in ("", "localhost"):
        raise InputError(
            f"SAMP_HUB: expected the lock file of a hub on this machine, found {given!r}"
        )
    return Path(unquote(parts.path))


def _require_here(url: str, path: Path) -> None:
    """Refuse a hub that does not answer on an address of this machine."""
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port
        is_here = parts.scheme == "http" and port is not None and _is_here(host)
    except ValueError:
        is_here = False
    if not is_here:
        raise InputError(f"{path}: expected a SAMP hub on this machine, found one at {url!r}")


def _is_here(host: str) -> bool:
    """Return whether all addresses of a host are of this machine: a server can have them."""
    try:
        found = socket.getaddrinfo(host, 0, type=socket.SOCK_DGRAM)
        for family, kind, protocol, _, address in found:
            with socket.socket(family, kind, protocol) as probe:
                probe.bind(address)
    except OSError:
        return False
    return bool(found)
