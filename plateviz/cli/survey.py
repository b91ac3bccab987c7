"""`plateviz survey`: what is asked for on the command line, and what is said of it."""

import re
from pathlib import Path

import typer

from plateviz.cli.output import print_json
from plateviz.solving.survey_fit import fit_and_report, require_all
from solver.data.settings import FitSettings
from solver.errors import InputError

_RANGE = re.compile(r"(\d+)(?:-(\d+))?")


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
