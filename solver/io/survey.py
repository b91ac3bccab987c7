"""Survey directories: tables of many orbits with one reference catalogue.

    survey.toml                        format, versions, instrument, settings; written last
    reference.parquet                  `schema.CATALOGUE`
    truth.parquet                      `schema.TRUTH`, if there is truth
    exposures.parquet                  `schema.ENVIRONMENT` of all orbits
    measurements/orbit=0000.parquet    `schema.MEASUREMENT` of one orbit
    defects/orbit=0000.parquet         `defect_schema.AFFECTED`: what simulated defects changed
    defects/reference.parquet          the same for the catalogue; no fit reads these files
    manifest.sha256                    SHA-256 of every other file, checked when it is read

A directory without `survey.toml` is not read: it is unfinished or not a survey. A survey grows
by orbits that `solver.io.survey_growth` adds.
"""

import hashlib
import re
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa

from solver.data.columns import Column
from solver.data.instrument import Instrument, instrument_from
from solver.data.orbit import OrbitData
from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT, TRUTH, Table
from solver.errors import InputError
from solver.io.atomic import sha256_of, write_atomically
from solver.io.consistency import (
    catalogue_problems,
    exposure_problems,
    place_problems,
    truth_problems,
)
from solver.io.manifest import (
    manifest_of,
)
from solver.io.parquet import write_parquet
from solver.io.read_orbit import find_catalogue
from solver.io.survey_header import HEADER, header_text, read_header
from solver.io.survey_manifest import MANIFEST, listed_files, require_unchanged_files
from solver.io.table_check import conform, matched_names, refuse

REFERENCE = "reference.parquet"
TRUTH_FILE = "truth.parquet"
EXPOSURES = "exposures.parquet"
MEASUREMENTS = "measurements"
DEFECTS = "defects"

_ORBIT_FILE = re.compile(r"orbit=(\d{4}|[1-9]\d{4,})\.parquet")


def measurement_path(directory: Path, orbit_id: int) -> Path:
    """Return the path of the measurements of an orbit."""
    return Path(directory) / MEASUREMENTS / f"orbit={orbit_id:04d}.parquet"


def survey_orbits(directory: Path) -> list[int]:
    """Return the ids of a survey's orbits, in order; those of missing files are among them.

    Raises
    ------
    InputError
        If the directory is not a complete survey.
    """
    read_header(directory)
    folder = Path(directory) / MEASUREMENTS
    names = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
    listed = (name.partition("/") for name in listed_files(Path(directory)))
    names |= {name for parent, _, name in listed if parent == MEASUREMENTS}
    return sorted(int(found[1]) for name in names if (found := _ORBIT_FILE.fullmatch(name)))


def has_survey_table(directory: Path, name: str) -> bool:
    """Return whether a survey has a table, be its file missing or not."""
    return (directory / name).is_file() or name in listed_files(directory)


def read_survey_orbit(directory: Path, orbit_id: int) -> OrbitData:
    """Read and check one orbit of a survey.

    Returns
    -------
    The tables of the orbit. The catalogue and the truth contain only the measured sources; the
    provenance lists every file read, the measurements first.

    Raises
    ------
    InputError
        If the directory is not a complete survey or has no such orbit, or if a table is
        invalid or the tables are inconsistent.
    """
    directory = Path(directory)
    orbits = survey_orbits(directory)
    if orbit_id not in orbits:
        raise InputError(
            f"{directory}: expected an orbit out of {orbit_ranges(orbits)}, found {orbit_id}"
        )
    paths = [measurement_path(directory, orbit_id), directory / REFERENCE, directory / EXPOSURES]
    if has_survey_table(directory, TRUTH_FILE):
        paths.append(directory / TRUTH_FILE)
    provenance = require_unchanged_files(directory, paths)
    measurements, exposures = _read_table(paths[0], MEASUREMENT), _exposures_of(paths[2], orbit_id)
    catalogue = _table_of_sources(paths[1], provenance[REFERENCE], CATALOGUE)
    _check_orbit(measurements, orbit_id, paths[0])
    where, where_catalogue, where_exposures = map(str, paths[:3])
    found = place_problems(measurements, where)
    found += exposure_problems(measurements, exposures, where, where_exposures)
    found += catalogue_problems(measurements, catalogue, where, where_catalogue)
    truth = None
    if (path := directory / TRUTH_FILE) in paths:
        truth = _table_of_sources(path, provenance[TRUTH_FILE], TRUTH)
        found += truth_problems(measurements, truth, where, str(path))
    refuse(found)
    key = list(ENVIRONMENT.key)
    return OrbitData(
        measurements=measurements,
        exposures=exposures.merge(measurements[key].drop_duplicates(), on=key, validate="1:1"),
        catalogue=_measured(catalogue, measurements),
        truth=None if truth is None else _measured(truth, measurements),
        provenance=provenance,
    )


def write_manifest(directory: Path, content: Mapping[str, object]) -> None:
    """Write the manifest of a survey, before its header with `content`, which is written last.

    Raises
    ------
    InputError
        If a table cannot be read or the manifest cannot be written.
    """
    folders = (".", MEASUREMENTS, DEFECTS)
    tables = [path for name in folders for path in (directory / name).glob("*.parquet")]
    names = [path.relative_to(directory).as_posix() for path in tables]
    header = hashlib.sha256(header_text(content).encode()).hexdigest()
    with write_atomically(directory / MANIFEST) as path:
        path.write_text(f"{manifest_of(directory, names)}{header}  {HEADER}\n", encoding="utf-8")


def read_survey_instrument(directory: Path) -> Instrument:
    """Return the instrument that took the orbits of a survey; raises as `read_header`."""
    path = Path(directory) / HEADER
    found = instrument_from(read_header(directory).get("instrument"), path)
    if found is None:
        raise InputError(f"{path}: expected the text of an instrument, found None")
    return found


def read_survey_table(path: Path, schema: Table) -> pd.DataFrame:
    """Read one table of a survey and convert it to `schema`.

    Raises
    ------
    InputError
        If the file is missing or not as it was written, or its table does not conform to the
        schema.
    """
    path = Path(path)
    require_unchanged_files(path.parents[path.parent.name in (MEASUREMENTS, DEFECTS)], [path])
    return _read_table(path, schema)


@lru_cache(maxsize=2)
def _table_of_sources(path: Path, digest: str, schema: Table) -> pd.DataFrame:
    """Read a table that all orbits of a survey share, once for all of them; it is not changed.

    Parameters
    ----------
    digest : SHA-256 of the file
    """
    frame = _read_table(path, schema)
    if sha256_of(path) != digest:
        raise InputError(f"{path}: expected no change while the file is read, found other contents")
    return frame


def _read_table(path: Path, schema: Table) -> pd.DataFrame:
    return conform(find_catalogue(path).table, schema, str(path))


def _exposures_of(path: Path, orbit_id: int) -> pd.DataFrame:
    """Read the exposures of an orbit; those of others may be wrong."""
    raw = find_catalogue(path).table
    name = matched_names(raw.colnames, ENVIRONMENT).get("orbit_id")
    if name is not None:
        is_of_orbit = np.asarray(raw[name] == orbit_id, dtype=bool)
        raw = raw[is_of_orbit] if is_of_orbit.any() else raw
    return conform(raw, ENVIRONMENT, str(path))


def write_survey_table(frame: pd.DataFrame, schema: Table, path: Path) -> None:
    """Write the columns of `schema` as Parquet, each with its unit.

    Optional columns without a default are left out if they are absent or hold no value.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    written = [column for column in schema if not _is_without_values(frame, column)]
    names = [column.name for column in written]
    content = pa.Table.from_pandas(frame[names], preserve_index=False)
    fields = [
        content.schema.field(column.name).with_metadata({"unit": column.unit})
        if column.unit
        else content.schema.field(column.name)
        for column in written
    ]
    with write_atomically(path) as temporary:
        write_parquet(content.cast(pa.schema(fields)), temporary)


def _is_without_values(frame: pd.DataFrame, column: Column) -> bool:
    if column.required or column.default is not None:
        return False
    return column.name not in frame or bool(frame[column.name].isna().all())


def _measured(sources: pd.DataFrame, measurements: pd.DataFrame) -> pd.DataFrame:
    measured = sources["source_id"].isin(measurements["source_id"].unique())
    return sources[measured].reset_index(drop=True)


def _check_orbit(measurements: pd.DataFrame, orbit_id: int, path: Path) -> None:
    found = measurements["orbit_id"].unique().tolist()
    if found != [orbit_id]:
        raise InputError(f"{path}, column orbit_id: expected {orbit_id} alone, found {found}")


def orbit_ranges(orbits: list[int]) -> str:
    """Return the ids of the orbits of a survey in words."""
    if not orbits:
        return "none, since there are no measurements"
    consecutive = orbits == list(range(orbits[0], orbits[-1] + 1))
    return f"{orbits[0]} to {orbits[-1]}" if consecutive else ", ".join(map(str, orbits))
