"""Dashboard: the whole dashboard in a cell, and as the page of `panel serve`.

In a cell it is a page of its own, served by this process and shown in a frame: so it has all
that it has elsewhere, and no cell has to hold its scripts. It answers between cells.
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
        """Take what to show.

        Parameters
        ----------
        port : TCP port to serve on; 0 takes a free one
        height : of the frame, screen pixels

        Raises
        ------
        InputError
            If they are not numbers of a port and of pixels.
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
        """Address of the page on this machine; the first call serves it.

        Raises
        ------
        InputError
            If the port is taken.
        """
        if not self._servers:
            # The server, and all that it draws with, takes seconds to import.
            from plateviz.dashboard.server import Place, begin, check_address

            port = check_address(_ADDRESS, self._port)
            self._servers.append(begin(self._solver.store, Place(port, _ADDRESS)))
            self._port = port
        return f"http://{_ADDRESS}:{self._port}/"

    def close(self) -> None:
        """Stop serving; the solver process stays."""
        _stop(self._servers)

    def servable(self) -> Self:
        """Make it the page where `panel serve` runs the notebook; elsewhere this changes nothing.

        Returns
        -------
        The dashboard itself, which a cell shows.
        """
        panel = sys.modules.get("panel")
        if panel is not None and panel.state.curdoc is not None:
            from plateviz.dashboard.app import build_app

            build_app(self._served()).servable()
        return self

    def __panel__(self) -> "pn.viewable.Viewable":
        """Return the dashboard as a part of a served page."""
        from plateviz.dashboard.app import build_part

        return build_part(self._served())

    def _served(self) -> SolutionStore:
        """Return the store for a page of this session, with whose end it is closed."""
        import panel as pn

        pn.extension("tabulator")
        pn.state.on_session_destroyed(lambda _: self._solver.close())
        return self._solver.store

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        words = {"text/plain": repr(self)}
        if notebook_shell() is None:
            return words
        address = escape(self.address, quote=True)
        frame = (
            f"<p><a href='{address}' target='_blank'>Open the dashboard in a tab of its own</a></p>"
            f"<iframe src='{address}' width='100%' height='{self._height}' "
            "style='border: 1px solid #d5dbe1;'></iframe>"
        )
        return {**words, "text/html": frame}

    def __repr__(self) -> str:
        """Return what it is."""
        return f"dashboard of {self._solver.origin.title}; the last line of a cell shows it"


def _stop(servers: list[Any]) -> None:
    while servers:
        servers.pop().stop()
