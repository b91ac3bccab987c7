"""`plateviz survey`: what is asked for on the command line, and what is said of it."""

import re
from pathlib import Path

import typer

from plateviz.cache import keep_compilations
from plateviz.cli_output import print_json, reporting
from solver.errors import FitError, InputError
from solver.settings import FitSettings

_RANGE = re.compile(r"(\d+)(?:-(\d+))?")
_MOST_NAMED = 20


def parse_orbits(text: str | None) -> list[int] | None:
    """Return the orbits of a text such as `0-9,12`; None for all of them.

    Raises
    ------
    InputError
        If it is not such a text.
    """
    if text is None:
        return None
    orbits: list[int] = []
    for word in text.split(","):
        found = _RANGE.fullmatch(word.strip())
        if not found or (found[2] and int(found[2]) < int(found[1])):
            raise InputError(
                f"--orbits: expected numbers and ranges such as 0-9,12, found {text!r}"
            )
        orbits.extend(range(int(found[1]), int(found[2] or found[1]) + 1))
    return orbits


def run_survey(
    survey: Path,
    name: str,
    settings: FitSettings,
    orbits: list[int] | None,
    workers: int | None,
    scheduler: str | None,
    as_json: bool,
) -> None:
    """Fit what is missing and say how it went; raises `FitError` where orbits failed."""
    if workers is not None and scheduler is not None:
        raise InputError("--workers: expected none with --scheduler, which has workers of its own")
    keep_compilations()
    from plateviz.survey import Progress, Report, fit_survey

    with reporting("starting the workers") as reporter:

        def show(progress: Progress) -> None:
            reporter.step(progress.done, progress.total)
            if progress.last is not None:
                failed = " failed" if progress.last.message else f": {progress.last.seconds:.1f} s"
                reporter.say(f"orbit {progress.last.orbit}{failed}")

        report: Report = fit_survey(survey, name, settings, orbits, workers, scheduler, show)
    if as_json:
        print_json(
            {
                "output": str(report.run.directory),
                "complete": report.run.is_complete,
                "fitted": report.fitted,
                "kept": report.kept,
                "failed": {str(orbit): words for orbit, words in report.failed.items()},
                "seconds": report.seconds,
            }
        )
    else:
        words = f"{len(report.fitted)} orbits fitted"
        words += f", {len(report.kept)} were there" if report.kept else ""
        state = "complete" if report.run.is_complete else "not complete yet"
        typer.echo(
            f"{report.run.directory}: {words}, in {report.seconds:.1f} s; the run is {state}"
        )
    if report.failed:
        raise FitError(_words(report.failed))


def _words(failed: dict[int, str]) -> str:
    lines = [f"  {message}" for _, message in sorted(failed.items())[:_MOST_NAMED]]
    more = len(failed) - len(lines)
    lines += [f"  and {more} more"] if more > 0 else []
    return "\n".join([f"{len(failed)} orbits failed; the others are kept:", *lines])
