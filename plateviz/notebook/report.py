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
"""Composes a report from its facts: command, run and versions."""


def write_report(
    compose: Compose, path: str | PathLike[str], call: str, run: str | None = None
) -> Path:
    """Write a report as one self-contained HTML file, with a line of progress.

    Parameters
    ----------
    call : Python code that returns the reported object
    run : name of the run, or None

    Raises
    ------
    InputError
        If the file cannot be written, or the object cannot be reported.
    """
    # These import HoloViews, which takes seconds.
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
    """Return a path given by the user, with "~" expanded.

    Raises
    ------
    InputError
        If it is not a path.
    """
    if not isinstance(given, str | PathLike):
        raise InputError(f"expected the path of a file or a folder, found {given!r}")
    return Path(fspath(given)).expanduser()  # type: ignore[arg-type]
