"""The web server: one process without JAX, safe by default, over one store."""

import contextlib
import gc
import re
import secrets
import socket
from collections.abc import Callable
from typing import Any, NamedTuple

import panel as pn

# The scripts of tables are sent with the page, before any session has a table.
import panel.models.tabulator
import panel_material_ui as pmui
from tornado.ioloop import IOLoop

from plateviz.dashboard.app import build_app, empty_page
from plateviz.dashboard.selection.large_selections import LargeSelections
from plateviz.dashboard.serving.closed_pages import silence_closed_pages
from plateviz.dashboard.serving.headers import NotebookHeaders, SecurityHeaders
from plateviz.dashboard.serving.limits import Limits, PageLimit
from plateviz.dashboard.serving.page_request import send_empty_pages
from plateviz.dashboard.serving.password import PasswordLogin
from plateviz.dashboard.serving.quick_components import make_components_quick
from plateviz.dashboard.serving.quick_models import make_models_quick
from plateviz.dashboard.serving.refused_requests import refuse_floods, refuse_paths
from plateviz.dashboard.serving.returned_memory import ReturnedMemory, keep_no_first_page
from plateviz.dashboard.serving.rooms import Rooms
from plateviz.dashboard.serving.unread_queries import ignore_unreadable_queries
from plateviz.dashboard.serving.waiting_messages import send_waiting_messages
from plateviz.dashboard.serving.websocket import LIMITS, check_websockets
from plateviz.solving.solution_store import SolutionStore
from solver.errors import InputError

# Time for a page that has lost its connection to come back to its session.
_LOST_MILLISECONDS = 60_000
# Time between two looks for sessions that can be ended.
_LOOK_MILLISECONDS = 5000
# A page sends events and a few properties; a selection of 8000 sources takes 60 kB.
_MESSAGE_BYTES = 2**20
# An address up to this long is answered in words; a browser shows an error of its own for others.
_HEADER_BYTES = 2**18
_HOST = re.compile(r"[a-z0-9]([a-z0-9.-]*[a-z0-9])?(:\d{1,5})?")
_PATH = re.compile(r"[A-Za-z0-9._~-]+(/[A-Za-z0-9._~-]+)*")
# Each open page takes some 10 MB.
PAGES, PAGES_PER_ADDRESS = 100, 40


class Endpoint(NamedTuple):
    """Address at which the dashboard is served, and from which browsers reach it.

    Attributes
    ----------
    port : TCP port, as from `check_address`
    address : of the interface to listen on; a loopback address cannot be reached from other
        machines
    proxies : hosts of reverse proxies, as browsers address them, from `check_origin`
    prefix : URL path of the page, as from `check_prefix`
    password : asked for before the page opens, if there is one
    in_notebook : whether notebooks of this machine show the page in a frame
    pages : most pages that are open at once
    pages_per_address : most of them from one address on the network
    """

    port: int
    address: str
    proxies: tuple[str, ...] = ()
    prefix: str = ""
    password: str | None = None
    in_notebook: bool = False
    pages: int = PAGES
    pages_per_address: int = PAGES_PER_ADDRESS


def serve(store: SolutionStore, endpoint: Endpoint, ready: Callable[[str], None]) -> None:
    """Serve the dashboard until interrupted; close the store at the end.

    Parameters
    ----------
    ready : called with the page's address once the server accepts connections
    """
    server = _server(store, endpoint)
    try:
        server.start()
        # What is there now stays; the collector need not go through it again for each page.
        gc.collect()
        gc.freeze()
        path = f"{endpoint.prefix}/" if endpoint.prefix else ""
        ready(f"http://{endpoint.address}:{endpoint.port}/{path}")
        # Ctrl-C is the normal way to end the server.
        with contextlib.suppress(KeyboardInterrupt):
            server.io_loop.start()
    finally:
        # DuckDB complains at the end of the process of what is not collected.
        gc.unfreeze()
        server.stop()
        store.close()


def begin(store: SolutionStore, endpoint: Endpoint) -> Any:  # noqa: ANN401 of Bokeh
    """Start and return a server on this thread's event loop, which the caller runs."""
    server = _server(store, endpoint)
    server.start()
    return server


def _server(store: SolutionStore, endpoint: Endpoint) -> Any:  # noqa: ANN401 of Bokeh
    silence_closed_pages()
    make_models_quick()
    make_components_quick()
    send_waiting_messages()
    ignore_unreadable_queries()
    check_websockets()
    hosts = sorted({endpoint.address, "localhost", "127.0.0.1"})
    rooms, large = Rooms(), LargeSelections()
    memory = ReturnedMemory(IOLoop.current())

    def make_page() -> pmui.Page:
        memory.follow()
        return build_app(store, rooms, large)

    # A server, not a thread, because `threaded` is not set.
    server: Any = pn.serve(
        make_page,
        port=endpoint.port,
        address=endpoint.address,
        # Websockets from pages of other hosts are refused.
        websocket_origin=[*(f"{host}:{endpoint.port}" for host in hosts), *endpoint.proxies],
        prefix=endpoint.prefix,
        title=f"plateviz · {store.title}",
        show=False,
        start=False,
        verbose=False,
        unused_session_lifetime_milliseconds=_LOST_MILLISECONDS,
        check_unused_sessions_milliseconds=_LOOK_MILLISECONDS,
        # A client cannot choose its session, nor have a payload of its own decompressed.
        sign_sessions=True,
        secret_key=secrets.token_bytes(),
        websocket_max_message_size=_MESSAGE_BYTES,
        http_server_kwargs={"max_header_size": _HEADER_BYTES},
        cookie_secret=secrets.token_hex(),
        **_login(endpoint.password),
    )
    keep_no_first_page(server.io_loop)
    _protect(server, store, endpoint)
    return server


def _protect(server: Any, store: SolutionStore, endpoint: Endpoint) -> None:  # noqa: ANN401 of Bokeh
    """Limit what clients can ask of a server, and tell browsers what its pages may do."""
    application = server._tornado  # noqa: SLF001 it has no public name
    pages = PageLimit(endpoint.pages, endpoint.pages_per_address)
    limits = application.settings[LIMITS] = Limits(pages, is_proxied=bool(endpoint.proxies))
    send_empty_pages(application, empty_page(store), limits, store.pause)
    refuse_floods(application, limits)
    refuse_paths(application)
    application.add_transform(NotebookHeaders if endpoint.in_notebook else SecurityHeaders)


def _login(password: str | None) -> dict[str, Any]:
    return {} if password is None else {"auth_provider": PasswordLogin(password)}


def check_address(address: str, port: int) -> int:
    """Check, before any other work, that an address and a port are free; return the port.

    Parameters
    ----------
    port : TCP port; 0 selects a free one

    Raises
    ------
    InputError
        If the port is taken, or the address does not belong to this machine.
    """
    try:
        with socket.create_server((address, port)) as probe:
            return int(probe.getsockname()[1])
    except (OSError, OverflowError) as error:
        raise InputError(
            f"expected an address and a port that are free, found {address}:{port}: {error}; "
            "--port 0 selects a free port"
        ) from error


def check_origin(text: str) -> str:
    """Return the host of a reverse proxy in the form that browsers send.

    Raises
    ------
    InputError
        If it is not a host, with or without a port.
    """
    host = text.strip().lower()
    if not _HOST.fullmatch(host):
        raise InputError(
            "--allow-origin: expected a host such as astro.example.org or "
            f"astro.example.org:8443, found {text!r}"
        )
    return host


def check_prefix(text: str) -> str:
    """Return the URL path of the page, without slashes at its ends.

    Raises
    ------
    InputError
        If it is not a valid URL path.
    """
    path = text.strip("/")
    if path and not _PATH.fullmatch(path):
        raise InputError(f"--prefix: expected a path such as plateviz, found {text!r}")
    return path
