"""Fit of a whole survey with a line of progress."""

import time
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from plateviz.cache import keep_compilations
from plateviz.solving.progress import reporting
from plateviz.tables.counts import duration_text, orbits_text
from plateviz.verdict.verdict import Verdict
from solver.data.settings import FitSettings
from solver.errors import DistrustError, FitError

if TYPE_CHECKING:
    from plateviz.runs.fit_survey import Progress, SurveyOutcome

_MAX_LISTED = 20


def fit_and_report(
    survey: Path,
    name: str,
    settings: FitSettings,
    orbits: list[int] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    repair: bool = False,
) -> "SurveyOutcome":
    """Fit the missing orbits, with a line of progress; arguments as for `fit_survey`."""
    keep_compilations()
    from plateviz.runs.fit_survey import fit_survey

    with reporting("starting the workers") as reporter:

        def show(progress: "Progress") -> None:
            reporter.step(progress.done, progress.total)
            if progress.last is not None:
                reporter.say(_progress_text(progress, time.perf_counter() - start))

        start = time.perf_counter()
        return fit_survey(survey, name, settings, orbits, workers, scheduler, show, repair)


def _progress_text(progress: "Progress", elapsed: float) -> str:
    """Return the text of the line: the outcome of the last orbit, and the time left."""
    last = progress.last
    text = "" if last is None else f"orbit {last.orbit}"
    text += " failed" if last is not None and last.message else ""
    left = elapsed / progress.done * (progress.total - progress.done)
    return f"{text}, {duration_text(left)} left"


def require_all(outcome: "SurveyOutcome") -> None:
    """Raise `FitError` with the reasons if orbits failed."""
    if outcome.failed:
        raise FitError(_failure_message(outcome.failed))


def require_trust(outcome: "SurveyOutcome", verdict: Verdict) -> None:
    """Raise `DistrustError` if the run, or the solutions of some orbits, should not be trusted."""
    orbits = list(map(str, outcome.distrusted))
    if orbits:
        listed = ", ".join(orbits[:_MAX_LISTED])
        listed += f" and {len(orbits) - _MAX_LISTED} more" if len(orbits) > _MAX_LISTED else ""
        raise DistrustError(
            f"the solutions of {orbits_text(len(orbits))} should not be trusted as they are: "
            f"{listed}; they are written. `plateviz report {quote(str(outcome.run.survey))} "
            f"--run {outcome.run.name} --orbit {orbits[0]} -o report.html` says why, and --accept "
            "ends with exit code 0"
        )
    if verdict.state == "bad":
        raise DistrustError(
            f"{verdict.headline} It is written. `plateviz report {quote(str(outcome.run.survey))} "
            f"--run {outcome.run.name} -o report.html` says why, and --accept ends with exit code 0"
        )


def _failure_message(failed: dict[int, str]) -> str:
    lines = [f"  {message}" for _, message in sorted(failed.items())[:_MAX_LISTED]]
    more = len(failed) - len(lines)
    lines += [f"  and {more} more"] if more > 0 else []
    return "\n".join([f"{orbits_text(len(failed))} failed; what else is fitted is kept:", *lines])
