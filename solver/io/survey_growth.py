"""Growth of a survey: an orbit is added so that readers see it as a whole or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pandas as pd

from solver.data.orbit import OrbitData
from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT
from solver.errors import InputError
from solver.io.atomic import sha256_of, write_atomically
from solver.io.consistency import (
    catalogue_problems,
    exposure_problems,
    place_problems,
    repeated_orbit_problems,
)
from solver.io.disk import writing
from solver.io.lock import locked
from solver.io.manifest import manifest_text
from solver.io.read_orbit import find_catalogue
from solver.io.scratch import scratch_beside
from solver.io.survey import (
    EXPOSURES,
    REFERENCE,
    measurement_path,
    read_survey_table,
    write_survey_table,
)
from solver.io.survey_header import read_header
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
        refuse(repeated_orbit_problems(exposures, f"{directory} with orbit {orbit.orbit_id}"))
        exposures = exposures.sort_values(list(ENVIRONMENT.key))
        with writing(path.parent, "to make the folder"):
            path.parent.mkdir(exist_ok=True)
        write_survey_table(orbit.measurements, MEASUREMENT, path)
        with _replaced(directory, path) as of_all:
            write_survey_table(exposures.reset_index(drop=True), ENVIRONMENT, of_all)
    return path


def _other_exposures(directory: Path, orbit_id: int) -> pd.DataFrame:
    """Return the exposures of a survey without those of an orbit; none before its first orbit."""
    path, listed = directory / EXPOSURES, listed_files(directory).get(EXPOSURES)
    if not path.is_file() and listed is None:
        return pd.DataFrame(columns=ENVIRONMENT.names)
    if path.is_file() and listed not in (None, sha256_of(path)):
        others = _before_a_kill(directory)
        if others is not None:
            return _without(others, orbit_id)
    return _without(read_survey_table(path, ENVIRONMENT), orbit_id)


def _before_a_kill(directory: Path) -> pd.DataFrame | None:
    """Return the exposures that the manifest lists, if killed calls have only added others."""
    path, listed = directory / EXPOSURES, listed_files(directory)
    exposures = conform(find_catalogue(path).table, ENVIRONMENT, str(path))
    is_listed = {
        orbit: measurement_path(directory, orbit).relative_to(directory).as_posix() in listed
        for orbit in exposures["orbit_id"].unique().tolist()
    }
    others = exposures[exposures["orbit_id"].map(is_listed)].reset_index(drop=True)
    with scratch_beside(path) as old:
        write_survey_table(others, ENVIRONMENT, old)
        return others if sha256_of(old) == listed.get(EXPOSURES) else None


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
    if orbit.orbit_id < 0:
        raise InputError(f"{where}: expected an orbit_id of 0 or more")
    found = place_problems(orbit.measurements, where)
    found += exposure_problems(orbit.measurements, orbit.exposures, where, f"{where}, exposures")
    catalogue = read_survey_table(reference, CATALOGUE)
    found += catalogue_problems(orbit.measurements, catalogue, where, str(reference))
    refuse(found)


@contextmanager
def _replaced(directory: Path, added: Path) -> Iterator[Path]:
    """Yield a path for new exposures; then put them in place, and at once their manifest, if any.

    Parameters
    ----------
    added : file of the measurements, which is listed in the manifest, too
    """
    exposures, manifest = directory / EXPOSURES, directory / MANIFEST
    if not manifest.is_file():
        with write_atomically(exposures) as new:
            yield new
        return
    with write_atomically(manifest) as listing, write_atomically(exposures) as new:
        yield new
        names = {added.relative_to(directory).as_posix(): sha256_of(added)}
        text = manifest_text(listed_files(directory) | names | {EXPOSURES: sha256_of(new)})
        listing.write_text(text, encoding="utf-8")
