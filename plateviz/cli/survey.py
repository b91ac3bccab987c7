"""`plateviz survey`: parse the orbits to fit, fit them, and print the outcome."""

import re
from pathlib import Path

import typer

from plateviz.cli.output import print_json
from plateviz.cli.survey_progress import fit_and_report, require_all, require_trust
from plateviz.tables.counts import orbits_text
from plateviz.verdict.verdict import as_plain
from solver.data.settings import FitSettings
from solver.errors import InputError

# More than any survey has.
_MOST_ORBITS = 1_000_000
_RANGE = re.compile(r"(\d+)(?:-(\d+))?")


def parse_orbits(text: str | None) -> list[int] | None:
    """Return the orbits in a text such as `0-9,12`; None, for all orbits, if there is no text.

    Raises
    ------
    InputError
        If the text has another form.
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
        first, last = int(found[1]), int(found[2] or found[1])
        if last - first >= _MOST_ORBITS:
            raise InputError(f"--orbits: expected fewer than {_MOST_ORBITS:,}, found {word!r}")
        orbits.extend(range(first, last + 1))
    return orbits


def run_survey(
    survey: Path,
    name: str,
    settings: FitSettings,
    orbits: list[int] | None,
    workers: int | None,
    scheduler: str | None,
    repair: bool,
    accept: bool,
    as_json: bool,
) -> None:
    """Fit the missing orbits and print the outcome.

    Raises
    ------
    FitError
        If orbits failed.
    DistrustError
        If the run, or solutions of its orbits, should not be trusted, unless the request accepts
        that.
    """
    if workers is not None and scheduler is not None:
        raise InputError(
            "--workers: expected none with --scheduler, which has its own workers, found both"
        )
    report = fit_and_report(survey, name, settings, orbits, workers, scheduler, repair)
    # Imported here, because it takes a while, and a mistake in the request should be told at once.
    from plateviz.runs.queries import SurveyRun
    from plateviz.runs.run_tables import read_run_verdict

    verdict = read_run_verdict(SurveyRun(report.run))
    if as_json:
        print_json(
            {
                "output": str(report.run.directory),
                "complete": report.run.is_complete,
                "fitted": report.fitted,
                "kept": report.kept,
                "failed": {str(orbit): reason for orbit, reason in report.failed.items()},
                "distrusted": {str(orbit): why for orbit, why in report.distrusted.items()},
                "seconds": report.seconds,
                "verdict": as_plain(verdict),
            }
        )
    else:
        counts = f"{orbits_text(len(report.fitted))} fitted"
        counts += f", {len(report.kept)} fitted before" if report.kept else ""
        state = "complete" if report.run.is_complete else "not complete yet"
        typer.echo(
            f"{report.run.directory}: {counts}, in {report.seconds:.1f} s; the run is {state}"
        )
        typer.echo(verdict.headline)
        if verdict.state != "good":
            for sentence in [*verdict.reasons, *verdict.notable]:
                typer.echo(f"  {sentence}")
    require_all(report)
    if not accept:
        require_trust(report, verdict)
