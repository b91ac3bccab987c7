"""Growth of a survey: an orbit is added so that readers see it as a whole or not at all."""

from pathlib import Path

import pandas as pd

from solver.data.orbit import OrbitData
from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT
from solver.errors import InputError
from solver.io.atomic import sha256_of, write_atomically
from solver.io.consistency import catalogue_problems, exposure_problems
from solver.io.disk import writing
from solver.io.lock import locked
from solver.io.manifest import manifest_text
from solver.io.read_orbit import find_catalogue
from solver.io.scratch import scratch_beside
from solver.io.survey import (
    EXPOSURES,
    REFERENCE,
    measurement_path,
    read_header,
    read_survey_table,
    write_survey_table,
)
from solver.io.survey_manifest import MANIFEST, listed_files
from solver.io.table_check import conform, refuse


def append_orbit(directory: Path, orbit: OrbitData) -> Path:
    """Add an orbit to a survey: its measurements, its exposures, and their lines of the manifest.

    The measurements are written first and the manifest last. An orbit that the manifest does not
    list is not part of the survey yet; if the process is killed, the same call adds it.

    Parameters
    ----------
    directory : of the survey; of processes that add orbits at once, the second waits
    orbit : as `read_orbit` returns it; its sources are in the survey's reference catalogue

    Returns
    -------
    The file of its measurements.

    Raises
    ------
    DiskError
        If the disk is full or read-only.
    InputError
        If the directory is not a survey, it has an orbit of that id, or the orbit's sources are
        not in its reference catalogue.
    """
    directory = Path(directory)
    read_header(directory)
    with locked(directory, wait=True):
        path = measurement_path(directory, orbit.orbit_id)
        others = _other_exposures(directory, orbit.orbit_id)
        _check(directory, orbit)
        exposures = pd.concat([others, orbit.exposures[ENVIRONMENT.names]])
        exposures = exposures.sort_values(list(ENVIRONMENT.key))
        with writing(path.parent, "to make the folder"):
            path.parent.mkdir(exist_ok=True)
        write_survey_table(orbit.measurements, MEASUREMENT, path)
        write_survey_table(exposures.reset_index(drop=True), ENVIRONMENT, directory / EXPOSURES)
        _list(directory, [path, directory / EXPOSURES])
    return path


def _other_exposures(directory: Path, orbit_id: int) -> pd.DataFrame:
    """Return the exposures of a survey without those of an orbit; none before its first orbit."""
    path = directory / EXPOSURES
    if not path.is_file() and EXPOSURES not in listed_files(directory):
        return pd.DataFrame(columns=ENVIRONMENT.names)
    try:
        return _without(read_survey_table(path, ENVIRONMENT), orbit_id)
    except InputError:
        others = _before_a_kill(directory, orbit_id)
        if others is None:
            raise
        return others


def _before_a_kill(directory: Path, orbit_id: int) -> pd.DataFrame | None:
    """Return the exposures that the manifest lists, if a killed call added only this orbit's."""
    path = directory / EXPOSURES
    others = _without(conform(find_catalogue(path).table, ENVIRONMENT, str(path)), orbit_id)
    with scratch_beside(path) as old:
        write_survey_table(others, ENVIRONMENT, old)
        return others if sha256_of(old) == listed_files(directory).get(EXPOSURES) else None


def _without(exposures: pd.DataFrame, orbit_id: int) -> pd.DataFrame:
    return exposures[exposures["orbit_id"] != orbit_id].reset_index(drop=True)


def _check(directory: Path, orbit: OrbitData) -> None:
    """Refuse an orbit that the survey has, or that does not belong to it."""
    path, reference = measurement_path(directory, orbit.orbit_id), directory / REFERENCE
    has_manifest = (directory / MANIFEST).is_file()
    name = path.relative_to(directory).as_posix()
    if name in listed_files(directory) if has_manifest else path.is_file():
        raise InputError(
            f"{directory}: expected an orbit that the survey does not have, found {orbit.orbit_id}"
        )
    where = f"orbit {orbit.orbit_id}"
    found = exposure_problems(orbit.measurements, orbit.exposures, where, f"{where}, exposures")
    catalogue = read_survey_table(reference, CATALOGUE)
    found += catalogue_problems(orbit.measurements, catalogue, where, str(reference))
    refuse(found)


def _list(directory: Path, changed: list[Path]) -> None:
    """Write the lines of changed files into the manifest, if the survey has one."""
    manifest = directory / MANIFEST
    if not manifest.is_file():
        return
    names = {path.relative_to(directory).as_posix(): sha256_of(path) for path in changed}
    with write_atomically(manifest) as path:
        path.write_text(manifest_text(listed_files(directory) | names), encoding="utf-8")
