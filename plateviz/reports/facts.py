"""Provenance of a report: the command, and the versions of the packages."""

import platform

from plateviz.reports.report import Facts
from solver.runtime.versions import versions_of

_PACKAGES = ("plateviz", "jax", "numpy", "scipy", "bokeh")


def facts_of(command: str, run: str | None = None) -> Facts:
    """Return the provenance of a report.

    Parameters
    ----------
    command : the command line of the user
    run : name of the survey's run, or None
    """
    made = {"Command": command} | ({} if run is None else {"Run": run})
    versions = {**versions_of(_PACKAGES), "Python": platform.python_version()}
    return {"Report": made, "Versions that made this report": versions}
