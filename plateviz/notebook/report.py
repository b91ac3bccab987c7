"""Reports written from a notebook: the files that `plateviz report` writes."""

from collections.abc import Callable
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING

from plateviz.notebook.progress import reporting
from solver.errors import InputError
from solver.io.atomic import require_writable, write_atomically

if TYPE_CHECKING:
    from plateviz.reports.report import Facts, Report

Compose = Callable[["Facts"], "Report"]
"""Gives a report of which the facts are known."""


def write_report(
    compose: Compose, path: str | PathLike[str], call: str, run: str | None = None
) -> Path:
    """Write a report as one HTML file that opens anywhere, with a line of progress.

    Parameters
    ----------
    call : what a person wrote to get what is reported
    run : of the survey, None where there is none

    Raises
    ------
    InputError
        If the file cannot be written, or there is nothing to report.
    """
    # These draw, and take as long to import as HoloViews does.
    from plateviz.reports.facts import facts_of
    from plateviz.reports.page import page_of

    target = path_of(path)
    require_writable(target)
    with reporting(f"report {target.name}") as reporter:
        report = compose(facts_of(f"{call}.report({fspath(path)!r})", run))
        page = page_of(report, reporter.step)
        with write_atomically(target) as temporary:
            temporary.write_text(page, encoding="utf-8")
    return target


def path_of(given: object) -> Path:
    """Return the path that a person gave, with the home folder for "~".

    Raises
    ------
    InputError
        If it is no path.
    """
    if not isinstance(given, str | PathLike):
        raise InputError(f"expected the path of a file or a folder, found {given!r}")
    return Path(fspath(given)).expanduser()  # type: ignore[arg-type]
