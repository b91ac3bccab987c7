"""`plateviz serve`: serve the dashboard of a survey or of the files of an orbit."""

import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plateviz.cli import options
from solver.errors import InputError

if TYPE_CHECKING:
    from plateviz.dashboard.server import Endpoint
    from plateviz.solving.solution_store import SolutionStore

MOST_SOLVERS = 16


def serve(
    path: Annotated[
        Path,
        typer.Argument(
            help="Survey directory; or, with REF, OBS as in `plateviz fit`.", metavar="DIR|OBS"
        ),
    ],
    reference: Annotated[Path | None, options.REFERENCE] = None,
    truth: options.Truth = None,
    orbit: options.Orbit = None,
    instrument: options.Instrument = None,
    port: options.Port = 5006,
    address: options.Address = "127.0.0.1",
    allow_origin: Annotated[
        list[str] | None,
        typer.Option(
            help="Host of a reverse proxy, as browsers address it, such as "
            "astro.example.org or astro.example.org:8443; may be repeated.",
            metavar="HOST[:PORT]",
        ),
    ] = None,
    prefix: Annotated[
        str,
        typer.Option(
            help="URL path under which a reverse proxy has the dashboard, such as plateviz.",
            metavar="PATH",
        ),
    ] = "",
    password_file: options.PasswordFile = None,
    no_password: options.NoPassword = False,
    pages: Annotated[
        int, typer.Option(help="Most pages that are open at once.", min=1, metavar="N")
    ] = 100,
    pages_per_address: Annotated[
        int,
        typer.Option(
            help="Most of them that are open from one address on the network.",
            min=1,
            metavar="N",
        ),
    ] = 40,
    solvers: Annotated[
        int | None,
        typer.Option(
            help="Number of solver processes, of which half keep to what-ifs and fits that take a "
            "second; as a rule three where the machine has the memory and the cores.",
            min=1,
            max=MOST_SOLVERS,
            metavar="N",
        ),
    ] = None,
    open_browser: options.OpenBrowser = True,
) -> None:
    """Show a survey, or the files of one orbit, in the dashboard."""
    from plateviz.dashboard.server import check_origin, check_prefix
    from plateviz.solving.capacity import usual_solvers
    from plateviz.solving.origin import OrbitFiles, SurveyFolder
    from plateviz.solving.solution_store import SolutionStore
    from plateviz.solving.solver_pool import SolverPool

    proxies = tuple(map(check_origin, allow_origin or []))
    endpoint = open_endpoint(port, address, password_file, no_password)
    endpoint = endpoint._replace(
        proxies=proxies,
        prefix=check_prefix(prefix),
        pages=pages,
        pages_per_address=pages_per_address,
    )
    if reference is None and (truth or instrument or orbit is not None):
        raise InputError(
            "--truth, --orbit, --instrument: expected with the files OBS and REF of an orbit only, "
            f"found the survey {path}"
        )
    if reference is None:
        origin: OrbitFiles | SurveyFolder = SurveyFolder(str(path))
        if not origin.orbits():
            raise InputError(
                f"{path}: expected a survey with an orbit, found none yet; `plateviz watch` fits "
                "the first one when it arrives"
            )
    else:
        origin = OrbitFiles(str(path), str(reference), _text(truth), orbit, _text(instrument))
        # Read once here, so that problems in the files are reported before a page opens.
        origin.read(orbit)
    solver = SolverPool(solvers or usual_solvers())
    run_server(SolutionStore(origin, solver), endpoint, open_browser)


def open_endpoint(
    port: int, address: str, password_file: Path | None, no_password: bool
) -> "Endpoint":
    """Return where to serve, and with which password; `InputError` if it cannot or must not be."""
    from plateviz.dashboard.server import Endpoint, check_address
    from plateviz.dashboard.serving.password import read_password, require_password

    password = None if password_file is None else read_password(password_file)
    require_password(address, password, no_password)
    return Endpoint(check_address(address, port), address, password=password)


def run_server(
    store: "SolutionStore",
    endpoint: "Endpoint",
    open_browser: bool,
    when_ready: Callable[[], object] | None = None,
) -> None:
    """Serve a store at an endpoint until interrupted; `when_ready` is called once it serves."""
    from plateviz.dashboard.server import serve as run

    def ready(page: str) -> None:
        typer.echo(f"plateviz serves on {page} until you press Ctrl-C")
        if open_browser:
            webbrowser.open(page)
        if when_ready is not None:
            when_ready()

    run(store, endpoint, ready)


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)
