"""`plateviz survey`: what is asked for on the command line, and what is said of it."""

import re
import time
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from plateviz.cache import keep_compilations
from plateviz.cli_output import print_json, reporting
from solver.errors import FitError, InputError
from solver.settings import FitSettings

if TYPE_CHECKING:
    from plateviz.survey import Progress, Report

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
    report = fit_and_report(survey, name, settings, orbits, workers, scheduler)
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
    require_all(report)


def fit_and_report(
    survey: Path,
    name: str,
    settings: FitSettings,
    orbits: list[int] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
) -> "Report":
    """Fit what is missing, with a line of progress; arguments as `plateviz.survey.fit_survey`."""
    keep_compilations()
    from plateviz.survey import fit_survey

    with reporting("starting the workers") as reporter:

        def show(progress: "Progress") -> None:
            reporter.step(progress.done, progress.total)
            if progress.last is not None:
                reporter.say(_state(progress, time.perf_counter() - start))

        start = time.perf_counter()
        return fit_survey(survey, name, settings, orbits, workers, scheduler, show)


def _state(progress: "Progress", elapsed: float) -> str:
    """Say what became of the last orbit, and how long the others will take."""
    last = progress.last
    words = "" if last is None else f"orbit {last.orbit}"
    words += " failed" if last is not None and last.message else ""
    left = elapsed / progress.done * (progress.total - progress.done)
    return f"{words}, {_duration(left)} left"


def _duration(seconds: float) -> str:
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


def require_all(report: "Report") -> None:
    """Raise `FitError` with the reasons if orbits failed."""
    if report.failed:
        raise FitError(_words(report.failed))


def _words(failed: dict[int, str]) -> str:
    lines = [f"  {message}" for _, message in sorted(failed.items())[:_MOST_NAMED]]
    more = len(failed) - len(lines)
    lines += [f"  and {more} more"] if more > 0 else []
    return "\n".join([f"{len(failed)} orbits failed; the others are kept:", *lines])
