"""`plateviz survey`: parse the orbits to fit, fit them, and print the outcome."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from plateviz.cli.output import print_json
from plateviz.cli.survey_progress import fit_and_report, require_all, require_trust
from plateviz.tables.counts import orbits_text
from plateviz.verdict.verdict import Verdict, as_plain
from solver.data.settings import FitSettings
from solver.errors import InputError

if TYPE_CHECKING:
    from plateviz.runs.fit_survey import SurveyOutcome

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


class SurveyRequest(NamedTuple):
    """Arguments of `plateviz survey`, named as those of `fit_survey`."""

    survey: Path
    name: str
    settings: FitSettings
    orbits: list[int] | None
    workers: int | None
    scheduler: str | None
    repair: bool
    accept: bool


def run_survey(request: SurveyRequest, as_json: bool) -> None:
    """Fit the missing orbits and print the outcome.

    Raises
    ------
    InputError
        If the request or the survey is not as expected.
    FitError
        If orbits failed.
    DistrustError
        If the run, or solutions of its orbits, should not be trusted, unless the request accepts
        that.
    """
    if request.workers is not None and request.scheduler is not None:
        raise InputError(
            "--workers: expected none with --scheduler, which has its own workers, found both"
        )
    outcome = fit_and_report(
        request.survey,
        request.name,
        request.settings,
        request.orbits,
        request.workers,
        request.scheduler,
        request.repair,
    )
    # Imported here, because it takes a while, and a mistake in the request should be told at once.
    from plateviz.runs.run import Run
    from plateviz.runs.run_tables import read_run_verdict

    verdict = read_run_verdict(Run(outcome.run))
    if as_json:
        print_json(_as_json(outcome, verdict))
    else:
        _print_text(outcome, verdict)
    require_all(outcome)
    if not request.accept:
        require_trust(outcome, verdict)


def _as_json(outcome: "SurveyOutcome", verdict: Verdict) -> dict[str, object]:
    return {
        "output": str(outcome.run.directory),
        "complete": outcome.run.is_complete,
        "fitted": outcome.fitted,
        "kept": outcome.kept,
        "failed": {str(orbit): reason for orbit, reason in outcome.failed.items()},
        "distrusted": {str(orbit): why for orbit, why in outcome.distrusted.items()},
        "seconds": outcome.seconds,
        "verdict": as_plain(verdict),
    }


def _print_text(outcome: "SurveyOutcome", verdict: Verdict) -> None:
    counts = f"{orbits_text(len(outcome.fitted))} fitted"
    counts += f", {len(outcome.kept)} fitted before" if outcome.kept else ""
    state = "complete" if outcome.run.is_complete else "not complete yet"
    typer.echo(f"{outcome.run.directory}: {counts}, in {outcome.seconds:.1f} s; the run is {state}")
    typer.echo(verdict.headline)
    if verdict.state != "good":
        for sentence in [*verdict.reasons, *verdict.notable]:
            typer.echo(f"  {sentence}")
