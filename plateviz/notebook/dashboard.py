"""Dashboard: the dashboard in a cell, or as the page of `panel serve`.

In a cell it is a separate page, served by this process and shown in a frame. It is therefore
complete, and the notebook does not contain its scripts. It responds while no cell runs.
"""

import sys
import weakref
from html import escape
from typing import TYPE_CHECKING, Any, Self

from plateviz.notebook.lazy_solver import LazySolver
from plateviz.notebook.progress import notebook_shell
from plateviz.solving.solution_store import SolutionStore
from solver.errors import InputError

if TYPE_CHECKING:
    import panel as pn

_ADDRESS = "127.0.0.1"
_HIGHEST_PORT = 65535


class Dashboard:
    """The dashboard of one origin, started when it is first shown."""

    def __init__(self, solver: LazySolver, port: int, height: int) -> None:
        """Set what to show, and where.

        Parameters
        ----------
        port : TCP port to serve on; 0 selects a free port
        height : height of the frame, screen pixels

        Raises
        ------
        InputError
            If the port or the height is invalid.
        """
        if not isinstance(port, int) or not 0 <= port <= _HIGHEST_PORT:
            raise InputError(f"port: expected 0 to {_HIGHEST_PORT}, found {port!r}")
        if not isinstance(height, int) or height < 1:
            raise InputError(f"height: expected a number of pixels, found {height!r}")
        self._solver, self._port, self._height = solver, port, height
        self._servers: list[Any] = []
        weakref.finalize(self, _stop, self._servers)

    @property
    def address(self) -> str:
        """Address of the page on this machine; the first access starts the server.

        Raises
        ------
        InputError
            If the port is taken.
        """
        if not self._servers:
            # The server and its plotting libraries take seconds to import.
            from plateviz.dashboard.server import Endpoint, begin, check_address

            port = check_address(_ADDRESS, self._port)
            endpoint = Endpoint(port, _ADDRESS, in_notebook=True)
            self._servers.append(begin(self._solver.store, endpoint))
            self._port = port
        return f"http://{_ADDRESS}:{self._port}/"

    def close(self) -> None:
        """Stop the server; the solver process continues."""
        _stop(self._servers)

    def servable(self) -> Self:
        """Make it the page if `panel serve` runs the notebook; otherwise do nothing.

        Returns
        -------
        The dashboard itself, for display in a cell.
        """
        panel = sys.modules.get("panel")
        if panel is not None and panel.state.curdoc is not None:
            from plateviz.dashboard.app import build_app

            build_app(self._session_store()).servable()
        return self

    def __panel__(self) -> "pn.viewable.Viewable":
        """Return the dashboard as a part of a page of `panel serve`."""
        from plateviz.dashboard.app import build_part

        return build_part(self._session_store())

    def _session_store(self) -> SolutionStore:
        """Return the store for a page of this session; the end of the session closes it."""
        import panel as pn

        pn.extension("tabulator")
        pn.state.on_session_destroyed(lambda _: self._solver.close())
        return self._solver.store

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        text = {"text/plain": repr(self)}
        if notebook_shell() is None:
            return text
        address = escape(self.address, quote=True)
        frame = (
            f"<p><a href='{address}' target='_blank'>Open the dashboard in a tab of its own</a></p>"
            f"<iframe src='{address}' width='100%' height='{self._height}' "
            "style='border: 1px solid #d5dbe1;'></iframe>"
        )
        return {**text, "text/html": frame}

    def __repr__(self) -> str:
        """Return the title."""
        return f"dashboard of {self._solver.origin.title}; the last line of a cell shows it"


def _stop(servers: list[Any]) -> None:
    while servers:
        servers.pop().stop()
