"""Read an orbit from an observation, a catalogue and optionally a truth, and check them."""

import os
from pathlib import Path
from shlex import quote
from typing import NamedTuple

import pandas as pd
from astropy.table import Table as RawTable

from solver.data import schema
from solver.data.orbit import OrbitData
from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT, TRUTH
from solver.errors import InputError
from solver.io.atomic import sha256_of
from solver.io.consistency import (
    catalogue_problems,
    exposure_problems,
    place_problems,
    truth_problems,
)
from solver.io.formats import has_reader, holds_one_table, place, read_tables
from solver.io.survey_header import HEADER, UNFINISHED, found_unfinished
from solver.io.table_check import conform, refuse

_MAX_LISTED_ORBITS = 10


class Located(NamedTuple):
    """A raw table, its location as text for messages, and the file it is in."""

    table: RawTable
    where: str
    path: Path


def read_orbit(
    obs: Path, reference: Path, truth: Path | None = None, orbit: int | None = None
) -> OrbitData:
    """Read one orbit and check its tables, separately and for consistency.

    The order of rows in the files does not matter. Exposures without measurements are
    dropped; the catalogue and the truth keep all rows. The truth need not contain every
    measured source.

    Parameters
    ----------
    obs : a FITS or VOTable file with the tables `measurement` and `environment`; or a file
        with the measurement table alone, with a file `environment` in the same folder; or
        a folder with these two files
    reference : file of the catalogue; its first table that has rows is read
    truth : file of the true catalogue, likewise
    orbit : the `orbit_id` to read; required if there are several

    Returns
    -------
    Tables as in `solver.data.schema`. In the provenance the observation is first and the
    catalogue second.

    Raises
    ------
    InputError
        If a file or table is invalid, or the tables are inconsistent.
    """
    measured, environment = find_observation(Path(obs))
    catalogue = find_catalogue(Path(reference))
    true = None if truth is None else find_catalogue(Path(truth))

    measurements = conform(measured.table, MEASUREMENT, measured.where)
    exposures = conform(environment.table, ENVIRONMENT, environment.where)
    stars = conform(catalogue.table, CATALOGUE, catalogue.where)
    truths = None if true is None else conform(true.table, TRUTH, true.where)

    measurements = _select(measurements, _choose(measurements, orbit, measured.where))
    found = place_problems(measurements, measured.where)
    found += exposure_problems(measurements, exposures, measured.where, environment.where)
    found += catalogue_problems(measurements, stars, measured.where, catalogue.where)
    if truths is not None and true is not None:
        found += truth_problems(measurements, truths, measured.where, true.where)
    refuse(found)
    return OrbitData(
        measurements=measurements,
        exposures=_measured(exposures, measurements),
        catalogue=stars,
        truth=truths,
        provenance=_hashes(measured, catalogue, true, environment),
    )


def find_observation(obs: Path) -> tuple[Located, Located]:
    """Return the raw measurement and environment tables of an observation.

    Raises
    ------
    InputError
        If either is missing or ambiguous.
    """
    if obs.is_dir():
        return _one_table(_file_in(obs, MEASUREMENT)), _one_table(_file_in(obs, ENVIRONMENT))
    if holds_one_table(obs):
        return _one_table(obs), _one_table(_file_in(obs.parent, ENVIRONMENT, obs.suffix))
    tables = read_tables(obs)
    return _named(obs, tables, MEASUREMENT), _named(obs, tables, ENVIRONMENT)


def observation_files(obs: Path) -> list[Path]:
    """Return every file that `find_observation` may read; none is opened."""
    if not obs.is_dir() and not holds_one_table(obs):
        return [obs]
    folder = obs if obs.is_dir() else obs.parent
    names = {*names_of(MEASUREMENT), *names_of(ENVIRONMENT)}
    there = sorted(folder.iterdir()) if folder.is_dir() else []
    return [obs, *(path for path in there if path.stem.lower() in names)]


def find_catalogue(path: Path) -> Located:
    """Return the first raw table of a file that has rows.

    Raises
    ------
    InputError
        If no table has rows.
    """
    tables = read_tables(path)
    for name, table in tables.items():
        if len(table):
            return Located(table, place(path, name), path)
    raise InputError(
        f"{path}: expected a table with at least one row, found "
        f"{'none in ' + ', '.join(tables) if tables else 'no table'}"
    )


def names_of(table: schema.Table) -> tuple[str, ...]:
    """Return the names by which a table is recognised in a file, in lower case."""
    return (table.name.lower(), *(alias.lower() for alias in table.aliases))


def _named(path: Path, tables: dict[str, RawTable], wanted: schema.Table) -> Located:
    present = {name.lower(): name for name in reversed(tables)}
    for name in names_of(wanted):
        if name in present:
            return Located(tables[present[name]], place(path, present[name]), path)
    raise InputError(
        f"{path}: expected a table (HDU) called {wanted.name!r}, "
        f"found {', '.join(tables) or 'no table at all'}"
    )


def _one_table(path: Path) -> Located:
    tables = read_tables(path)
    if len(tables) != 1:
        raise InputError(f"{path}: expected one table, found {', '.join(tables) or 'none'}")
    name, table = next(iter(tables.items()))
    return Located(table, place(path, name), path)


def _file_in(folder: Path, wanted: schema.Table, preferred_suffix: str = "") -> Path:
    files = [p for p in sorted(folder.iterdir()) if has_reader(p) and p.is_file()]
    for name in names_of(wanted):
        candidates = [p for p in files if p.stem.lower() == name]
        same = [p for p in candidates if p.suffix.lower() == preferred_suffix.lower()]
        if len(same or candidates) > 1:
            raise InputError(
                f"{folder}: expected one file with the {wanted.name} table, "
                f"found {', '.join(p.name for p in same or candidates)}"
            )
        if candidates:
            return (same or candidates)[0]
    _refuse_unfinished(folder)
    raise InputError(
        f"{folder}: expected a file called {wanted.name} (.fits, .ecsv, .csv, .parquet or .xml), "
        f"found {', '.join(p.name for p in files) or 'no table file'}{_if_of_survey(folder)}"
    )


def _refuse_unfinished(folder: Path) -> None:
    """Refuse the directory of a survey that is not whole yet, and its folder of measurements."""
    for survey in (folder, folder.parent):
        if (survey / UNFINISHED).is_file():
            raise InputError(f"{survey}: expected a survey, found {found_unfinished(survey)}")


def _if_of_survey(folder: Path) -> str:
    """Return what to do with a survey directory, or its folder of measurements; else nothing."""
    survey = next((p for p in (folder, folder.parent) if (p / HEADER).is_file()), None)
    if survey is None:
        return ""
    return (
        f"; {survey} is a survey, of which `plateviz survey {quote(str(survey))} --orbits N` "
        "fits orbit N"
    )


def _choose(measurements: pd.DataFrame, orbit: int | None, where: str) -> int:
    orbits = sorted(int(o) for o in measurements["orbit_id"].unique())
    listed = ", ".join(str(o) for o in orbits[:_MAX_LISTED_ORBITS])
    if len(orbits) > _MAX_LISTED_ORBITS:
        listed += f" and {len(orbits) - _MAX_LISTED_ORBITS} more"
    if orbit is None and len(orbits) > 1:
        raise InputError(
            f"{where}, column orbit_id: expected one orbit, or a choice of the orbit to read, "
            f"found the orbits {listed}"
        )
    chosen = orbits[0] if orbit is None else orbit
    if chosen not in orbits:
        raise InputError(f"{where}, column orbit_id: expected orbit {chosen}, found only {listed}")
    return chosen


def _select(measurements: pd.DataFrame, orbit: int) -> pd.DataFrame:
    return measurements[measurements["orbit_id"] == orbit].reset_index(drop=True)


def _measured(exposures: pd.DataFrame, measurements: pd.DataFrame) -> pd.DataFrame:
    key = list(ENVIRONMENT.key)
    return exposures.merge(measurements[key].drop_duplicates(), on=key, validate="1:1")


def _hashes(
    measured: Located, catalogue: Located, truth: Located | None, environment: Located
) -> dict[str, str]:
    files = [measured.path, catalogue.path, *([truth.path] if truth else []), environment.path]
    hashes: dict[str, str] = {}
    for path in dict.fromkeys(Path(os.path.realpath(file)) for file in files):
        # Files of the same name in different folders are told apart by the folder's name.
        name = path.name if path.name not in hashes else f"{path.parent.name}/{path.name}"
        hashes[name] = sha256_of(path)
    return hashes
