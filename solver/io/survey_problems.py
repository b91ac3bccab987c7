"""What may be wrong with the orbits of a survey together, beside damaged files."""

import re
from pathlib import Path

import numpy as np
import pandas as pd

from solver.data.schema import ENVIRONMENT
from solver.errors import InputError
from solver.io.consistency import repeated_orbit_problems
from solver.io.parquet import count_rows
from solver.io.read_orbit import find_catalogue
from solver.io.survey import EXPOSURES, MEASUREMENTS, measurement_path, survey_orbits
from solver.io.survey_manifest import listed_files
from solver.io.table_check import matched_names

_NUMBERED = re.compile(r"orbit=(\d+)\.parquet")


def survey_problems(directory: Path) -> list[str]:
    """Return a message for each orbit that is misnamed, unreadable, or a copy of another one.

    Files that a manifest lists are left out: it tells whether they are as they were written.

    Raises
    ------
    InputError
        If the directory is not a survey.
    """
    return [
        *misnamed_orbits(directory),
        *_unreadable_orbits(directory),
        *copied_orbits(directory),
    ]


def copied_orbits(directory: Path) -> list[str]:
    """Return a message if orbits have the same exposures; none if these cannot be read."""
    try:
        raw = find_catalogue(directory / EXPOSURES).table
    except InputError:
        return []
    names = matched_names(raw.colnames, ENVIRONMENT)
    exposures = pd.DataFrame({name: np.ma.filled(raw[found]) for name, found in names.items()})
    return repeated_orbit_problems(exposures, str(directory / EXPOSURES))


def misnamed_orbits(directory: Path) -> list[str]:
    """Return a message for each file of measurements that is not read because of its name."""
    found = []
    for path in sorted((directory / MEASUREMENTS).glob("orbit=*.parquet")):
        match = _NUMBERED.fullmatch(path.name)
        wanted = measurement_path(directory, int(match[1])) if match else None
        if wanted != path:
            name = "orbit=NNNN.parquet" if wanted is None else wanted.name
            place = path.relative_to(directory).as_posix()
            found.append(f"{place} is not read, since its name is not {name}")
    return found


def _unreadable_orbits(directory: Path) -> list[str]:
    found, listed = [], listed_files(directory)
    for orbit in survey_orbits(directory):
        path = measurement_path(directory, orbit)
        if path.relative_to(directory).as_posix() not in listed:
            try:
                count_rows(str(path))
            except InputError as error:
                found.append(str(error))
    return found
