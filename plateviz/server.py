"""The web server: one process without JAX, safe by default, over one workbench."""

import contextlib
import socket
from collections.abc import Callable
from typing import Any

import panel as pn

from plateviz.app import build_app
from plateviz.workbench import Workbench
from solver.errors import InputError

# How long a page may take to load its scripts before its session is given up.
_PATIENCE_MILLISECONDS = 120_000


def serve(workbench: Workbench, *, port: int, address: str, ready: Callable[[str], None]) -> None:
    """Serve the dashboard until it is interrupted; the workbench is closed at the end.

    Parameters
    ----------
    port : TCP port, as from `check_address`
    address : of the interface to listen on; other machines reach it only where it is not
        a loopback address
    ready : called with the page's address once it can be opened
    """
    pn.extension("tabulator")
    hosts = sorted({address, "localhost", "127.0.0.1"})
    # A thread is what it gives only where it is asked to make one.
    server: Any = pn.serve(
        lambda: build_app(workbench),
        port=port,
        address=address,
        websocket_origin=[f"{host}:{port}" for host in hosts],
        title=f"plateviz · {workbench.title}",
        show=False,
        start=False,
        verbose=False,
        unused_session_lifetime_milliseconds=_PATIENCE_MILLISECONDS,
    )
    try:
        server.start()
        ready(f"http://{address}:{port}/")
        # Ctrl-C is how a person ends it.
        with contextlib.suppress(KeyboardInterrupt):
            server.io_loop.start()
    finally:
        server.stop()
        workbench.close()


def check_address(address: str, port: int) -> int:
    """Return the port to serve on, having found out before any work that it is free.

    Parameters
    ----------
    port : 0 for any that is free

    Raises
    ------
    InputError
        If it could not: the port is taken, or the address is not this machine's.
    """
    try:
        with socket.create_server((address, port)) as trial:
            return int(trial.getsockname()[1])
    except (OSError, OverflowError) as error:
        raise InputError(
            f"expected an address and a port that are free, found {address}:{port}: {error}"
        ) from error
