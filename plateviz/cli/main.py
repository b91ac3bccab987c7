"""The command line: `plateviz simulate | inspect | fit | survey | watch | serve | report | ...`.

A user's mistake ends with exit code 2 and one message; a fit that has no solution, or has not
converged, with exit code 1; one whose solution should not be trusted with exit code 3. Each
command imports the slow modules that it needs, so that `--help` and error messages appear at once.
SIGTERM ends a command as Ctrl-C does, with exit code 143.
"""

import os
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from plateviz.cache import keep_compilations
from plateviz.cli import options
from plateviz.cli.gaia import gaia
from plateviz.cli.inspect import inspect
from plateviz.cli.report import report
from plateviz.cli.reproduce import reproduce
from plateviz.cli.serve import open_endpoint, run_server, serve
from plateviz.cli.watch import watch
from plateviz.runs.run_directory import DEFAULT_RUN
from plateviz.tables.counts import orbits_text
from solver.data.settings import ENGINES
from solver.errors import DistrustError, FitError, InputError
from solver.io.disk import FULL, disk_error
from solver.runtime.termination import ending_on_sigterm

app = typer.Typer(
    help="Solve the astrometry of satellite orbits by Plate Analysis, and judge the solutions.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

_JSON = typer.Option("--json", help="Print JSON instead of text.")
_OBS = typer.Argument(
    help="Measurements and exposures: a FITS or VOTable file, a folder with measurement.* "
    "and environment.*, or one of these two files.",
    metavar="OBS",
)


@app.command()
def demo(
    port: options.Port = 5006,
    address: options.Address = "127.0.0.1",
    password_file: options.PasswordFile = None,
    no_password: options.NoPassword = False,
    open_browser: options.OpenBrowser = True,
) -> None:
    """Make a small survey once, fit it, and show it in the dashboard.

    The page opens with the first orbit; the others are fitted behind it. A demo that was
    stopped resumes, and one that is complete opens at once.
    """
    from plateviz.solving.solver_queue import SolverQueue

    with ExitStack() as stack:
        # Its imports take as long as those of the server, which follow.
        solver = SolverQueue()
        stack.callback(solver.close)
        from plateviz.cli.demo import (
            BackgroundFit,
            demo_directory,
            make_survey,
            request_first_orbit,
        )
        from plateviz.solving.origin import SurveyFolder
        from plateviz.solving.progress import reporting
        from plateviz.solving.solution_store import SolutionStore

        endpoint = open_endpoint(port, address, password_file, no_password)
        directory = demo_directory()
        with reporting("starting the solver") as reporter:
            run = make_survey(directory, solver, reporter)
        store = SolutionStore(SurveyFolder(str(directory)), solver)
        stack.callback(store.close)
        fit = BackgroundFit(run, request_first_orbit(store, run))
        stack.callback(fit.close)
        run_server(store, endpoint, open_browser, fit.start)


@app.command()
def simulate(
    directory: Annotated[Path, typer.Argument(help="Survey directory to create.", metavar="DIR")],
    orbits: Annotated[int, typer.Option(help="Number of orbits.", min=1)] = 100,
    seed: Annotated[int, typer.Option(help="Seed of the random numbers.", min=0)] = 0,
    stars: Annotated[
        int | None,
        typer.Option(help="Number of stars in the extended field; 132,651 by default.", min=1),
    ] = None,
    catalog: Annotated[
        Path | None,
        typer.Option(help="Gaia table to use as the true catalogue; synthetic by default."),
    ] = None,
    defect: Annotated[
        list[str] | None,
        typer.Option(
            help="Defect to simulate, such as distortion-drift=0.1um or noise=10%; repeatable. "
            "The page Defects lists them.",
            metavar="NAME=AMPLITUDE",
        ),
    ] = None,
    magnitudes: Annotated[
        bool, typer.Option("--magnitudes", help="Add magnitudes to catalogue and measurements.")
    ] = False,
    noise_by_magnitude: Annotated[
        bool,
        typer.Option(
            "--noise-by-magnitude",
            help="Let uncertainties of measurements depend on magnitudes; implies --magnitudes.",
        ),
    ] = False,
    as_json: Annotated[bool, _JSON] = False,
) -> None:
    """Simulate the paper's mini-mock survey; an interrupted simulation resumes."""
    from plateviz.cli.output import print_json, telling_if_interrupted
    from plateviz.solving.progress import reporting
    from solver.simulate.settings import SurveySettings

    start = time.perf_counter()
    keep_compilations()
    from solver.simulate.survey import simulate_survey

    settings = SurveySettings(
        orbits=orbits,
        seed=seed,
        magnitudes=magnitudes,
        noise_by_magnitude=noise_by_magnitude,
        defects=tuple(defect or ()),
    )
    if stars is not None:
        settings = settings.scaled(stars)
    resumes = telling_if_interrupted("the same command continues with the orbits that are missing")
    with resumes, reporting("simulating") as reporter:
        simulate_survey(directory, settings, catalogue=catalog, progress=reporter.step)
    seconds = time.perf_counter() - start
    if as_json:
        print_json({"output": str(directory), "orbits": orbits, "seconds": seconds})
    else:
        typer.echo(f"{directory}: survey of {orbits_text(orbits)}, simulated in {seconds:.1f} s")


app.command()(gaia)


app.command()(inspect)


@app.command()
@options.takes_settings("fit", {"engine": "`all` runs every engine and checks that they agree."})
def fit(
    observations: Annotated[Path, _OBS],
    reference: Annotated[Path, options.REFERENCE],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Result file to write (FITS).", metavar="RESULT")
    ],
    truth: options.Truth = None,
    orbit: options.Orbit = None,
    checkpoint: Annotated[
        Path | None,
        typer.Option(help="File for the state of svi, from which a stopped fit resumes."),
    ] = None,
    instrument: options.Instrument = None,
    overwrite: options.Overwrite = False,
    accept: Annotated[
        bool,
        typer.Option(
            "--accept", help="End with exit code 0 even if the solution should not be trusted."
        ),
    ] = False,
    as_json: Annotated[bool, _JSON] = False,
    **settings: Any,  # noqa: ANN401 the options of the settings
) -> None:
    """Solve one orbit and write the solution."""
    from plateviz.cli.fit import FitRequest, run_fit
    from plateviz.cli.output import telling_if_interrupted
    from plateviz.solving.origin import OrbitFiles

    engines = ENGINES if settings["engine"] == "all" else (settings["engine"],)
    chosen = options.fit_settings({**settings, "engine": engines[0]})
    files = OrbitFiles(str(observations), str(reference), _text(truth), orbit, _text(instrument))
    request = FitRequest(files, orbit, chosen, engines, output, checkpoint, overwrite, accept)
    begun = "an svi that has a --checkpoint resumes, another fit begins again"
    with telling_if_interrupted(f"no solution is written; {begun}"):
        run_fit(request, as_json)


@app.command()
@options.takes_settings("survey")
def survey(
    directory: Annotated[Path, typer.Argument(help="Survey directory.", metavar="DIR")],
    run: Annotated[
        str, typer.Option(help="Name of the run; an incomplete run resumes.")
    ] = DEFAULT_RUN,
    orbits: Annotated[
        str | None, typer.Option(help="Orbits to fit, such as 0-9,12; all by default.")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            help="Number of worker processes on this machine; one per core by default.", min=1
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address of a Dask scheduler whose workers fit the orbits instead."),
    ] = None,
    repair: Annotated[
        bool,
        typer.Option("--repair", help="Fit orbits again whose files are damaged."),
    ] = False,
    accept: Annotated[
        bool,
        typer.Option(
            "--accept", help="End with exit code 0 even if solutions should not be trusted."
        ),
    ] = False,
    as_json: Annotated[bool, _JSON] = False,
    **settings: Any,  # noqa: ANN401 the options of the settings
) -> None:
    """Fit every orbit of a survey; an interrupted run resumes."""
    from plateviz.cli.output import telling_if_interrupted
    from plateviz.cli.survey import SurveyRequest, parse_orbits, run_survey

    chosen, numbers = options.fit_settings(settings), parse_orbits(orbits)
    request = SurveyRequest(directory, run, chosen, numbers, workers, scheduler, repair, accept)
    with telling_if_interrupted("the same command continues with the orbits that are missing"):
        run_survey(request, as_json)


app.command()(watch)
app.command()(serve)
app.command()(report)
app.command()(reproduce)


def main() -> None:
    """Run the command line; what goes wrong ends with one message and an exit code."""
    try:
        with ending_on_sigterm():
            try:
                app()
            finally:
                # Python would do it after all that tells of errors.
                sys.stdout.flush()
    except (InputError, FitError) as error:
        _fail(error)
    except OSError as error:
        # Such as standard output redirected to a full disk; any other one is a defect.
        told = disk_error(error, Path(error.filename or "standard output"))
        if told is None or error.errno not in FULL:
            raise
        _drop_output()
        _fail(told)


def _drop_output() -> None:
    """Drop what is left to be printed: Python would try again, and end with its own exit code."""
    with suppress(OSError, ValueError), open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())


def _fail(error: InputError | FitError) -> NoReturn:
    typer.echo(f"plateviz: {error}", err=True)
    sys.exit(_exit_code(error))


def _exit_code(error: InputError | FitError) -> int:
    if isinstance(error, InputError):
        return 2
    return 3 if isinstance(error, DistrustError) else 1


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)


if __name__ == "__main__":
    main()
