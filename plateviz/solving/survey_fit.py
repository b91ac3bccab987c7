"""Fit of a whole survey with a line of progress."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

from plateviz.cache import keep_compilations
from plateviz.solving.progress import reporting
from solver.data.settings import FitSettings
from solver.errors import FitError

if TYPE_CHECKING:
    from plateviz.runs.fit_survey import Progress, Report

_MOST_NAMED = 20


def fit_and_report(
    survey: Path,
    name: str,
    settings: FitSettings,
    orbits: list[int] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
) -> "Report":
    """Fit what is missing, with a line of progress; arguments as `fit_survey`."""
    keep_compilations()
    from plateviz.runs.fit_survey import fit_survey

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
