"""Reports written from a notebook: the files that `plateviz report` writes."""

from collections.abc import Callable
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING

from plateviz.notebook.progress import reporting
from solver.errors import InputError
from solver.io.atomic import write_atomically
from solver.io.outputs import PAGE_SUFFIXES, check_output

if TYPE_CHECKING:
    from plateviz.reports.report import Facts, Report

Compose = Callable[["Facts"], "Report"]
"""Composes a report from its facts: command, run and versions."""


def write_report(
    compose: Compose,
    path: str | PathLike[str],
    call: str,
    overwrite: bool,
    run: str | None = None,
) -> Path:
    """Write a report as one self-contained HTML file, with a line of progress.

    Parameters
    ----------
    call : Python code that returns the reported object
    overwrite : whether an existing file is replaced
    run : name of the run, or None

    Raises
    ------
    InputError
        If the file cannot be written, it exists and is not to be overwritten, or the object
        cannot be reported.
    """
    # These import Bokeh, which takes seconds.
    from plateviz.reports.facts import facts_of
    from plateviz.reports.page import page_of

    target = path_of(path)
    check_output(target, PAGE_SUFFIXES, overwrite=overwrite)
    with reporting(f"report {target.name}") as reporter:
        report = compose(facts_of(f"{call}.report({fspath(path)!r})", run))
        page = page_of(report, reporter.step)
        with write_atomically(target, overwrite) as temporary:
            temporary.write_text(page, encoding="utf-8", errors="replace")
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
