"""`plateviz report`: one HTML file of an orbit, a source or a survey."""

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from plateviz.cli import options
from plateviz.runs.run_directory import DEFAULT_RUN
from solver.errors import InputError

if TYPE_CHECKING:
    from plateviz.reports.more_figures import MoreFigures
    from plateviz.reports.report import Facts, Report
    from plateviz.runs.kept_solutions import KeptSolution
    from plateviz.runs.run import Run
    from solver.data.result import FitResult


class ReportRequest(NamedTuple):
    """Arguments of `plateviz report`."""

    path: Path
    orbit: int | None
    source: int | None
    survey: bool
    run: str
    other: str | None
    instrument: Path | None
    both: tuple[str, ...] = ()
    explore: tuple[str, ...] = ()

    @property
    def more(self) -> "MoreFigures":
        """The figures besides those of every report."""
        from plateviz.reports.more_figures import MoreFigures

        return MoreFigures(self.both, self.explore)


def report(
    path: Annotated[
        Path,
        typer.Argument(
            help="Survey directory, a result file of `fit`, or a solution kept in the dashboard "
            "(DIR/solutions/NAME).",
            metavar="DIR|RESULT",
        ),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="File to write (HTML).", metavar="REPORT")
    ],
    orbit: Annotated[int | None, typer.Option(help="Report the orbit with this id.")] = None,
    source: Annotated[int | None, typer.Option(help="Report the source with this id.")] = None,
    survey: Annotated[
        bool, typer.Option("--survey", help="Report the whole survey (the default).")
    ] = False,
    run: Annotated[str, typer.Option(help="Name of the run.")] = DEFAULT_RUN,
    other: Annotated[
        str | None,
        typer.Option(
            help="What to compare with: the name of another run of the survey, or, of an orbit, a "
            "result file."
        ),
    ] = None,
    instrument: Annotated[
        Path | None,
        typer.Option(help="Instrument (TOML file) of a result file; the mini-mock's by default."),
    ] = None,
    both: Annotated[
        list[str] | None,
        typer.Option(
            help="Also draw this figure of both solutions, such as residual-map, or of both runs, "
            "such as orbit-health; may be repeated.",
            metavar="FIGURE",
        ),
    ] = None,
    explore: Annotated[
        list[str] | None,
        typer.Option(
            help="Also draw a column against another, as the address of the Explore workspace "
            "says it: 'rows=measurements&x=focal_x&y=residual_x'; may be repeated.",
            metavar="COLUMNS",
        ),
    ] = None,
    pdf: Annotated[
        bool, typer.Option("--pdf", help="Also print the report to PDF with Chromium.")
    ] = False,
    pages: Annotated[
        bool,
        typer.Option(
            "--pages", help="Write a folder: an index page of the survey, and a page per orbit."
        ),
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(
            help="Number of worker processes for --pages; one per core by default.", min=1
        ),
    ] = None,
    overwrite: options.Overwrite = False,
) -> None:
    """Write a report: one HTML file that needs no network."""
    more = tuple(both or ()), tuple(explore or ())
    request = ReportRequest(path, orbit, source, survey, run, other, instrument, *more)
    if pages:
        _write_pages(request, output, pdf or overwrite, workers)
    elif workers is not None:
        raise InputError("--workers: expected with --pages only, found a single page")
    else:
        _write_page(request, output, pdf, overwrite)


def _write_pages(request: ReportRequest, folder: Path, has_more: bool, workers: int | None) -> None:
    of_one_page = (request.orbit, request.source, request.other, request.instrument)
    has_more |= bool(request.survey or request.both or request.explore)
    if has_more or any(option is not None for option in of_one_page):
        raise InputError(
            "--pages: expected no option but --run and --workers, found an option of a single page"
        )
    from plateviz.reports.folder import write_folder
    from plateviz.runs.run import open_run
    from plateviz.solving.progress import reporting

    with reporting("reading") as reporter:
        run = open_run(request.path, request.run)
        made, kept = write_folder(run, folder, _facts(request.run), workers, reporter.step)
    already = f", {kept} already there" if kept else ""
    typer.echo(f"{folder / 'index.html'}: {made} orbit pages written{already}")


def _write_page(request: ReportRequest, output: Path, pdf: bool, overwrite: bool) -> None:
    from plateviz.reports.pdf import find_chromium, print_pdf
    from plateviz.solving.progress import reporting
    from solver.io.atomic import write_atomically
    from solver.io.outputs import PAGE_SUFFIXES, check_output

    inputs = [Path(one) for one in (request.path, request.other, request.instrument) if one]
    printed = output.with_suffix(".pdf")
    check_output(output, PAGE_SUFFIXES, inputs, overwrite)
    if pdf:
        check_output(printed, (), inputs, overwrite)
        find_chromium()
    with reporting("reading") as reporter:
        content = _compose(request)
        reporter.say("drawing the figures")
        from plateviz.reports.page import page_of

        page = page_of(content, reporter.step)
        with write_atomically(output, overwrite) as temporary:
            temporary.write_text(page, encoding="utf-8", errors="replace")
        if pdf:
            reporter.say("printing")
            print_pdf(output, printed, overwrite)
    typer.echo(f"{output}: {content.title}, {output.stat().st_size / 1e6:.1f} MB")
    if pdf:
        typer.echo(f"{printed}: printed")


def _compose(request: ReportRequest) -> "Report":
    if not request.path.is_dir():
        return _compose_from_file(request)
    from plateviz.runs.kept_solutions import kept_solution

    if (kept := kept_solution(request.path)) is not None:
        return _compose_from_kept(request, kept)
    chosen = [request.orbit is not None, request.source is not None, request.survey]
    if sum(chosen) > 1:
        raise InputError("report: expected one of --orbit, --source and --survey, found several")
    if request.instrument is not None:
        raise InputError(
            "--instrument: expected with a result of `plateviz fit` only, found a survey"
        )
    if request.other is not None and request.source is not None:
        raise InputError("--other: expected with an orbit or a survey, found --source")
    if request.both and request.other is None:
        raise InputError("--both: expected with --other, found nothing to compare with")
    if request.explore and request.source is not None:
        raise InputError("--explore: expected with an orbit or a survey, found --source")
    from plateviz.reports.survey import source_report, survey_orbit_report, survey_report
    from plateviz.runs.run import open_run

    run, facts = open_run(request.path, request.run), _facts(request.run)
    if request.source is not None:
        return source_report(run, request.source, facts)
    if request.orbit is None:
        return survey_report(run, facts, _other_run(request), request.more)
    other = _other_solution(request, request.orbit)
    return survey_orbit_report(run, request.orbit, facts, other, more=request.more)


def _compose_from_file(request: ReportRequest) -> "Report":
    if request.orbit is not None or request.source is not None or request.survey:
        raise InputError(
            f"{request.path}: expected a survey directory with --orbit, --source or --survey, "
            "found no directory"
        )
    from plateviz.reports.orbit import orbit_report
    from plateviz.reports.report import SOLVED
    from solver.io.result import read_result, read_versions
    from solver.io.result_instrument import instrument_of

    result = read_result(request.path)
    focal_plane = instrument_of(result, request.instrument)
    other = read_result(Path(request.other)) if request.other else None
    facts = {**_facts(), SOLVED: read_versions(request.path)}
    return orbit_report(result, focal_plane, facts, other, more=request.more)


def _compose_from_kept(request: ReportRequest, kept: "KeptSolution") -> "Report":
    if request.orbit is not None or request.source is not None or request.survey:
        raise InputError(
            f"{request.path}: expected a survey directory with --orbit, --source or --survey, "
            "found a kept solution"
        )
    from plateviz.reports.orbit import orbit_report
    from plateviz.runs.kept_solutions import simulation_of_kept, survey_instrument_of
    from solver.io.result import read_result
    from solver.io.result_instrument import instrument_of

    result = kept.read()
    focal_plane = instrument_of(result, request.instrument, survey_instrument_of(kept))
    other = read_result(Path(request.other)) if request.other else None
    simulation = simulation_of_kept(kept)
    return orbit_report(
        result, focal_plane, _facts(), other, simulation=simulation, more=request.more
    )


def _other_solution(request: ReportRequest, orbit: int) -> "FitResult | None":
    """Return the solution of `--other`: a result file, or the orbit in another run."""
    if request.other is None:
        return None
    from plateviz.runs.run import open_run
    from solver.io.result import read_result

    path = Path(request.other)
    return (
        read_result(path) if path.is_file() else open_run(request.path, request.other).result(orbit)
    )


def _other_run(request: ReportRequest) -> "Run | None":
    if request.other is None:
        return None
    if request.other == request.run:
        raise InputError(f"--other: expected another run than {request.run!r}, found the same")
    from plateviz.runs.run import open_run

    return open_run(request.path, request.other)


def _facts(run: str | None = None) -> "Facts":
    """Return the command, the run and the versions that made the report."""
    from plateviz.reports.facts import facts_of

    return facts_of(shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]]), run)
