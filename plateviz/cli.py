"""The command line: `plateviz demo | simulate | inspect | fit | serve`.

A user's mistake ends with exit code 2 and one message; a fit that has no solution, or
has not converged, with exit code 1. What takes long to import is imported by the
command that needs it, so that `--help` and mistakes answer at once.
"""

import sys
import time
import webbrowser
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from plateviz.cache import keep_compilations
from solver.errors import FitError, InputError
from solver.exclusions import parse_exclusions
from solver.parameters import PARAMETERS
from solver.prior_text import parse_shift, parse_width
from solver.settings import ENGINES, FitSettings, NutsSettings, svi_settings

if TYPE_CHECKING:
    from plateviz.workbench import Workbench

app = typer.Typer(
    help="Plate Analysis of satellite orbits: fit, look, decide whether to trust the solution.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

_GROUPS = ", ".join(group.name for group in PARAMETERS)
_PORT = typer.Option(help="TCP port to serve on; 0 takes a free one.", min=0, max=65535)
_ADDRESS = typer.Option(help="Interface to serve on. Only this machine can reach the default.")
_OPEN = typer.Option("--open/--no-open", help="Open the page in your browser.")
_TRUTH = typer.Option(help="True catalogue of a simulation, to compare with.")
_ORBIT = typer.Option(help="Orbit to take where the file holds several.")
_INSTRUMENT = typer.Option(help="Instrument as a TOML file; the mini-mock's by default.")
_JSON = typer.Option("--json", help="Print one JSON value for machines.")
_OBS = typer.Argument(
    help="Measurements and exposures: a FITS or VOTable file, a folder with measurement.* "
    "and environment.*, or one of those files.",
    metavar="OBS",
)
_REF = typer.Argument(
    help="Reference catalogue: FITS, VOTable, ECSV, CSV or Parquet.", metavar="REF"
)


@app.command()
def demo(
    port: Annotated[int, _PORT] = 5006,
    address: Annotated[str, _ADDRESS] = "127.0.0.1",
    open_browser: Annotated[bool, _OPEN] = True,
) -> None:
    """Make a small survey once, fit it, and show it in the dashboard."""
    from plateviz.cli_output import reporting
    from plateviz.demo import demo_directory, open_survey, require_done, simulation
    from plateviz.server import check_address
    from plateviz.worker import Worker

    port = check_address(address, port)
    directory = demo_directory()
    with ExitStack() as stack, reporting("starting the solver") as reporter:
        worker = Worker()
        stack.callback(worker.close)
        survey = simulation(directory)
        if survey is not None:
            reporter.follow(worker.submit(survey))
            require_done(survey)
        workbench, first = open_survey(directory, worker)
        reporter.follow(first)
        require_done(first)
        # From here the server closes it, with the workbench.
        stack.pop_all()
    _serve(workbench, port, address, open_browser)


@app.command()
def simulate(
    directory: Annotated[Path, typer.Argument(help="Survey directory to make.", metavar="DIR")],
    orbits: Annotated[int, typer.Option(help="Number of orbits.", min=1)] = 100,
    seed: Annotated[int, typer.Option(help="Seed of all random numbers.", min=0)] = 0,
    stars: Annotated[
        int | None, typer.Option(help="Stars in the extended field, instead of 132,651.", min=1)
    ] = None,
    catalog: Annotated[
        Path | None,
        typer.Option(help="Gaia table to take as the truth, instead of a synthetic one."),
    ] = None,
    as_json: Annotated[bool, _JSON] = False,
) -> None:
    """Simulate the paper's mini-mock survey; an interrupted one is gone on with."""
    from plateviz.cli_output import print_json, reporting
    from solver.simulate.settings import SurveySettings

    start = time.perf_counter()
    keep_compilations()
    from solver.simulate.survey import simulate_survey

    settings = SurveySettings(orbits=orbits, seed=seed)
    if stars is not None:
        settings = settings.scaled(stars)
    with reporting("simulating") as reporter:
        simulate_survey(directory, settings, catalogue=catalog, progress=reporter.step)
    seconds = time.perf_counter() - start
    if as_json:
        print_json({"output": str(directory), "orbits": orbits, "seconds": seconds})
    else:
        typer.echo(f"{directory}: a survey of {orbits} orbits, made in {seconds:.1f} s")


@app.command()
def inspect(
    files: Annotated[list[Path], typer.Argument(help="Files to look into.", metavar="FILE...")],
    as_json: Annotated[bool, _JSON] = False,
) -> None:
    """Say what files are, what they hold, and everything that is wrong with them."""
    from plateviz.cli_output import print_inspection, print_json
    from solver.io.inspect import inspect_files

    reports = inspect_files(files)
    if as_json:
        print_json(reports)
    else:
        print_inspection(reports)
    if any(report["problems"] for report in reports):
        raise typer.Exit(2)


@app.command()
def fit(
    observations: Annotated[Path, _OBS],
    reference: Annotated[Path, _REF],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Result file to write (FITS).", metavar="RESULT")
    ],
    truth: Annotated[Path | None, _TRUTH] = None,
    orbit: Annotated[int | None, _ORBIT] = None,
    order: Annotated[int, typer.Option(help="Order of the distortion, 0 to 9.")] = 5,
    engine: Annotated[
        str, typer.Option(help=f"One of: {', '.join(ENGINES)}; or all, to see whether they agree.")
    ] = ENGINES[0],
    prior: Annotated[
        list[str] | None,
        typer.Option(
            help="Prior width of a parameter group, such as distortion_x=0.5um or "
            f"position_angle=flat; may be repeated. Groups: {_GROUPS}.",
            metavar="GROUP=VALUE",
        ),
    ] = None,
    centre: Annotated[
        list[str] | None,
        typer.Option(
            help="Shift the centre of a prior from the value in the files, such as "
            "focal_length=100um or detector_x[2]=-5um; may be repeated. An element is "
            "FIELD/PLATE, a detector, K/L of a distortion term, or ra or dec of sources.",
            metavar="GROUP[ELEMENT]=SHIFT",
        ),
    ] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option(
            help="Leave out measurements: source=ID, exposure=FIELD/PLATE or detector=ID; "
            "may be repeated.",
            metavar="WHAT",
        ),
    ] = None,
    aberration: Annotated[
        bool, typer.Option(help="Model the aberration by the observer's velocity.")
    ] = True,
    robust: Annotated[
        bool, typer.Option("--robust", help="Look for outliers, list them and leave them out.")
    ] = False,
    compare_orders: Annotated[
        bool,
        typer.Option(
            "--compare-orders", help="Also solve every order, to see which one the data ask for."
        ),
    ] = False,
    thin: Annotated[
        int, typer.Option(help="Use one in so many sources, for a quick look or nuts.", min=1)
    ] = 1,
    seed: Annotated[int, typer.Option(help="Seed of svi and nuts.", min=0)] = 0,
    steps: Annotated[
        int | None, typer.Option(help="Steps over which svi's learning rate falls.", min=1)
    ] = None,
    compat: Annotated[
        str | None,
        typer.Option(help="warpfield: svi in the units and with the rates of the published code."),
    ] = None,
    checkpoint: Annotated[
        Path | None,
        typer.Option(help="File to keep an svi run in; a run that was stopped goes on from it."),
    ] = None,
    instrument: Annotated[Path | None, _INSTRUMENT] = None,
    as_json: Annotated[bool, _JSON] = False,
) -> None:
    """Solve one orbit and write the solution."""
    from plateviz.cli_fit import FitRequest, run_fit
    from plateviz.source import OrbitFiles

    settings = FitSettings(
        order,
        ENGINES[0] if engine == "all" else engine,
        _prior_widths(prior or []),
        aberration,
        parse_exclusions(exclude or []),
        robust=robust,
        compare_orders=compare_orders,
        thin=thin,
        svi=svi_settings(compat, steps, seed),
        nuts=NutsSettings(seed=seed),
        prior_shifts=dict(map(parse_shift, centre or [])),
    )
    files = OrbitFiles(str(observations), str(reference), _text(truth), orbit, _text(instrument))
    engines = ENGINES if engine == "all" else (engine,)
    run_fit(FitRequest(files, orbit, settings, engines, output, checkpoint), as_json)


@app.command()
def serve(
    path: Annotated[
        Path, typer.Argument(help="Survey directory, or OBS as of `fit`.", metavar="DIR|OBS")
    ],
    reference: Annotated[Path | None, _REF] = None,
    truth: Annotated[Path | None, _TRUTH] = None,
    orbit: Annotated[int | None, _ORBIT] = None,
    instrument: Annotated[Path | None, _INSTRUMENT] = None,
    port: Annotated[int, _PORT] = 5006,
    address: Annotated[str, _ADDRESS] = "127.0.0.1",
    open_browser: Annotated[bool, _OPEN] = True,
) -> None:
    """Show a survey, or the orbit in some files, in the dashboard."""
    from plateviz.server import check_address
    from plateviz.source import OrbitFiles, SurveyFolder
    from plateviz.workbench import Workbench
    from plateviz.worker import Worker

    port = check_address(address, port)
    if reference is None:
        source: OrbitFiles | SurveyFolder = SurveyFolder(str(path))
        source.orbits()
    else:
        source = OrbitFiles(str(path), str(reference), _text(truth), orbit, _text(instrument))
        # Read once here, so that what is wrong with the files is said before a page opens.
        source.read(orbit)
    _serve(Workbench(source, Worker()), port, address, open_browser)


def main() -> None:
    """Run the command line; a user's mistake is one message and exit code 2."""
    try:
        app()
    except InputError as error:
        typer.echo(f"plateviz: {error}", err=True)
        sys.exit(2)
    except FitError as error:
        typer.echo(f"plateviz: {error}", err=True)
        sys.exit(1)


def _serve(workbench: "Workbench", port: int, address: str, open_browser: bool) -> None:
    from plateviz.server import serve as run

    def ready(page: str) -> None:
        typer.echo(f"plateviz serves on {page} until you press Ctrl-C")
        if open_browser:
            webbrowser.open(page)

    run(workbench, port=port, address=address, ready=ready)


def _prior_widths(texts: list[str]) -> dict[str, float]:
    widths = {}
    for text in texts:
        name, found, value = text.partition("=")
        if not found:
            raise InputError(f"--prior: expected GROUP=VALUE, found {text!r}")
        widths[name.strip()] = parse_width(name.strip(), value)
    return widths


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)


if __name__ == "__main__":
    main()
