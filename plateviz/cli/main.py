"""The command line: `plateviz simulate | gaia | inspect | fit | survey | serve | report | ...`.

A user's mistake ends with exit code 2 and one message; a fit that has no solution, or
has not converged, with exit code 1. What takes long to import is imported by the
command that needs it, so that `--help` and mistakes answer at once.
"""

import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from plateviz.cache import keep_compilations
from plateviz.cli import options
from plateviz.cli.gaia import gaia
from plateviz.cli.report import report
from plateviz.cli.reproduce import reproduce
from plateviz.cli.serve import run_server, serve
from plateviz.runs.run import DEFAULT_RUN
from solver.data.settings import ENGINES, NutsSettings, svi_settings
from solver.errors import FitError, InputError

app = typer.Typer(
    help="Plate Analysis of satellite orbits: fit, look, decide whether to trust the solution.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

_JSON = typer.Option("--json", help="Print one JSON value for machines.")
_OBS = typer.Argument(
    help="Measurements and exposures: a FITS or VOTable file, a folder with measurement.* "
    "and environment.*, or one of those files.",
    metavar="OBS",
)


@app.command()
def demo(
    port: options.Port = 5006,
    address: options.Address = "127.0.0.1",
    open_browser: options.OpenBrowser = True,
) -> None:
    """Make a small survey once, fit it, and show it in the dashboard.

    The page opens with the first orbit; the others are fitted behind it. A demo that was
    stopped resumes, and one that is complete opens at once.
    """
    from plateviz.solving.warm_solver import WarmSolver

    with ExitStack() as stack:
        # Its imports take as long as those of the server, which follow.
        solver = WarmSolver()
        stack.callback(solver.close)
        from plateviz.cli.demo import (
            BackgroundFit,
            demo_directory,
            make_survey,
            request_first_orbit,
        )
        from plateviz.dashboard.server import Place, check_address
        from plateviz.solving.origin import SurveyFolder
        from plateviz.solving.progress import reporting
        from plateviz.solving.solution_store import SolutionStore

        place = Place(check_address(address, port), address)
        directory = demo_directory()
        with reporting("starting the solver") as reporter:
            run = make_survey(directory, solver, reporter)
        store = SolutionStore(SurveyFolder(str(directory)), solver)
        stack.callback(store.close)
        fit = BackgroundFit(run, request_first_orbit(store, run))
        stack.callback(fit.close)
        run_server(store, place, open_browser, fit.start)


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
    from plateviz.cli.output import print_json
    from plateviz.solving.progress import reporting
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


app.command()(gaia)


@app.command()
def inspect(
    files: Annotated[list[Path], typer.Argument(help="Files to look into.", metavar="FILE...")],
    as_json: Annotated[bool, _JSON] = False,
) -> None:
    """Say what files are, what they hold, and everything that is wrong with them."""
    from plateviz.cli.output import print_inspection, print_json
    from solver.io.inspect import inspect_files

    found = inspect_files(files)
    if as_json:
        print_json(found)
    else:
        print_inspection(found)
    if any(one["problems"] for one in found):
        raise typer.Exit(2)


@app.command()
def fit(
    observations: Annotated[Path, _OBS],
    reference: Annotated[Path, options.REFERENCE],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Result file to write (FITS).", metavar="RESULT")
    ],
    truth: options.Truth = None,
    orbit: options.Orbit = None,
    order: options.Order = 5,
    engine: Annotated[
        str, typer.Option(help=f"One of: {', '.join(ENGINES)}; or all, to see whether they agree.")
    ] = ENGINES[0],
    prior: options.Prior = None,
    centre: options.Centre = None,
    exclude: options.Exclude = None,
    aberration: options.Aberration = True,
    robust: options.Robust = False,
    compare_orders: Annotated[
        bool,
        typer.Option(
            "--compare-orders", help="Also solve every order, to see which one the data ask for."
        ),
    ] = False,
    thin: options.Thin = 1,
    seed: options.Seed = 0,
    steps: options.Steps = None,
    compat: options.Compat = None,
    checkpoint: Annotated[
        Path | None,
        typer.Option(help="File to keep an svi run in; a run that was stopped goes on from it."),
    ] = None,
    instrument: options.Instrument = None,
    as_json: Annotated[bool, _JSON] = False,
) -> None:
    """Solve one orbit and write the solution."""
    from plateviz.cli.fit import FitRequest, run_fit
    from plateviz.solving.origin import OrbitFiles

    settings = options.fit_settings(
        order=order,
        engine=ENGINES[0] if engine == "all" else engine,
        prior=prior,
        centre=centre,
        exclude=exclude,
        aberration=aberration,
        robust=robust,
        compare_orders=compare_orders,
        thin=thin,
        svi=svi_settings(compat, steps, seed),
        nuts=NutsSettings(seed=seed),
    )
    files = OrbitFiles(str(observations), str(reference), _text(truth), orbit, _text(instrument))
    engines = ENGINES if engine == "all" else (engine,)
    run_fit(FitRequest(files, orbit, settings, engines, output, checkpoint), as_json)


@app.command()
def survey(
    directory: Annotated[Path, typer.Argument(help="Survey directory.", metavar="DIR")],
    run: Annotated[
        str, typer.Option(help="Name of the run; one that was begun is gone on with.")
    ] = DEFAULT_RUN,
    orbits: Annotated[
        str | None, typer.Option(help="Orbits to fit, such as 0-9,12; all by default.")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(help="Processes on this machine; one for each core by default.", min=1),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address of a Dask scheduler whose workers are to do it instead."),
    ] = None,
    order: options.Order = 5,
    engine: Annotated[str, typer.Option(help=f"One of: {', '.join(ENGINES)}.")] = ENGINES[0],
    prior: options.Prior = None,
    centre: options.Centre = None,
    exclude: options.Exclude = None,
    aberration: options.Aberration = True,
    robust: options.Robust = False,
    thin: options.Thin = 1,
    seed: options.Seed = 0,
    as_json: Annotated[bool, _JSON] = False,
) -> None:
    """Fit every orbit of a survey; one that was interrupted is gone on with."""
    from plateviz.cli.survey import parse_orbits, run_survey

    settings = options.fit_settings(
        order=order,
        engine=engine,
        prior=prior,
        centre=centre,
        exclude=exclude,
        aberration=aberration,
        robust=robust,
        thin=thin,
        svi=svi_settings(None, None, seed),
        nuts=NutsSettings(seed=seed),
    )
    run_survey(directory, run, settings, parse_orbits(orbits), workers, scheduler, as_json)


app.command()(serve)
app.command()(report)
app.command()(reproduce)


def main() -> None:
    """Run the command line; a user's mistake is one message and exit code 2."""
    try:
        app()
    except (InputError, FitError) as error:
        typer.echo(f"plateviz: {error}", err=True)
        sys.exit(2 if isinstance(error, InputError) else 1)


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)


if __name__ == "__main__":
    main()
