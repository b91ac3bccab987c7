"""One fitted orbit of a run: read, and refused if the directory has another orbit."""

from collections.abc import Callable
from pathlib import Path

from plateviz.runs.fitted_orbit import read_fitted_orbit
from solver.data.result import FitResult
from solver.errors import InputError


def read_orbit(
    directory: Path, orbit: int, read: Callable[[Path], FitResult] | None = None
) -> FitResult:
    """Return a fitted orbit of a run.

    Parameters
    ----------
    read : as `read_fitted_orbit`, which it is by default

    Raises
    ------
    InputError
        If it cannot be read, or is another orbit: each file of a directory that was copied to
        the name of another one is as it was written.
    """
    result = (read or read_fitted_orbit)(directory)
    found = sorted({*result.exposures["orbit_id"].tolist()})
    if found != [orbit]:
        raise InputError(
            f"{directory}: expected orbit {orbit}, found {', '.join(map(str, found))}; remove the "
            "directory, and `plateviz survey` fits the orbit again"
        )
    return result
