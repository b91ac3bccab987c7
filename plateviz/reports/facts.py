"""What made a report: the command, and the versions of what it called."""

import platform

from plateviz.reports.report import Facts
from solver.runtime.versions import versions_of

_PACKAGES = ("plateviz", "jax", "numpy", "scipy", "holoviews", "bokeh")


def facts_of(command: str, run: str | None = None) -> Facts:
    """Return what made a report.

    Parameters
    ----------
    command : as a person gave it
    run : of the survey, None where there is none
    """
    made = {"Command": command} | ({} if run is None else {"Run": run})
    versions = {**versions_of(_PACKAGES), "Python": platform.python_version()}
    return {"Report": made, "Versions that made this report": versions}
