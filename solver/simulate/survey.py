"""Simulate a survey to disk: catalogue, exposures and the measurements of every orbit."""

from collections.abc import Callable, Mapping
from pathlib import Path

import pandas as pd

from solver.data.defect_schema import AFFECTED
from solver.data.instrument import MINI_MOCK, Instrument, write_instrument
from solver.data.plural import plural
from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT, TRUTH
from solver.errors import InputError
from solver.io.atomic import flush, sha256_of
from solver.io.disk import writing
from solver.io.lock import locked
from solver.io.read_orbit import find_catalogue
from solver.io.scratch import is_scratch, remove_abandoned
from solver.io.survey import (
    DEFECTS,
    EXPOSURES,
    MEASUREMENTS,
    REFERENCE,
    TRUTH_FILE,
    measurement_path,
    read_survey_table,
    write_manifest,
    write_survey_table,
)
from solver.io.survey_header import HEADER, UNFINISHED, read_header, section, write_header
from solver.runtime.device import require_device
from solver.runtime.versions import versions_of
from solver.simulate.catalogue import (
    reference_catalogue,
    truth_catalogue,
    truth_from_gaia,
)
from solver.simulate.defects.stages import defective_catalogue, none_affected, recorded_exposures
from solver.simulate.measure import measure_orbit
from solver.simulate.schedule import environment, orbit_attitude
from solver.simulate.settings import SurveySettings

_PACKAGES = ("plateviz", "jax", "numpy", "pyerfa")


def simulate_survey(
    directory: Path,
    settings: SurveySettings | None = None,
    instrument: Instrument = MINI_MOCK,
    catalogue: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Simulate a survey into `directory`, or resume one that was interrupted.

    Files of orbits are written atomically, and existing ones are kept when the simulation is
    resumed with the same settings. `survey.toml`, which appears last, marks a complete survey.

    Parameters
    ----------
    directory : created if absent
    settings : defaults to those of the paper
    instrument : nominal focal plane
    catalogue : table of the Gaia archive to use as the truth; without it stars are synthetic
    progress : called with the number of finished orbits and of all orbits; an exception from
        it stops the simulation

    Raises
    ------
    DiskError
        If the disk is full or read-only; what was written before is kept.
    InputError
        If the directory contains anything except the same survey unfinished, another process is
        simulating it, the catalogue is invalid, an orbit has no reference star, or JAX has no
        device.
    """
    require_device()
    directory, settings = Path(directory), settings or SurveySettings()
    header = _header(settings, instrument, catalogue)
    _make(directory)
    with locked(directory) as is_ours:
        if not is_ours:
            raise InputError(
                f"{directory}: expected a directory that no other process is simulating into, "
                "found one that another process is simulating into; wait for it, or give another "
                "directory"
            )
        _claim(directory, header)
        _simulate(directory, settings, instrument, catalogue, progress)
        write_manifest(directory, header)
        # One step, so that a survey is never both, or neither.
        (directory / UNFINISHED).replace(directory / HEADER)
        flush(directory)


def _simulate(
    directory: Path,
    settings: SurveySettings,
    instrument: Instrument,
    catalogue: Path | None,
    progress: Callable[[int, int], None] | None,
) -> None:
    """Write the tables of a survey that are not there yet."""
    truth = _truth(settings, catalogue)
    exposures = [
        recorded_exposures(
            environment(orbit_attitude(orbit_id, settings, instrument.focal_length_um)),
            settings,
            orbit_id,
        )
        for orbit_id in range(settings.orbits)
    ]
    reference = reference_catalogue(truth, settings)
    reference, affected = defective_catalogue(reference, truth, settings)
    write_survey_table(truth, TRUTH, directory / TRUTH_FILE)
    write_survey_table(reference, CATALOGUE, directory / REFERENCE)
    write_survey_table(pd.concat(exposures, ignore_index=True), ENVIRONMENT, directory / EXPOSURES)
    _write_affected(affected, directory / DEFECTS / REFERENCE)
    for orbit_id in range(settings.orbits):
        path = measurement_path(directory, orbit_id)
        if not path.exists():
            measured = measure_orbit(orbit_id, truth, settings, instrument)
            _check_seen(measured.measurements, truth, orbit_id)
            # First, since an orbit with measurements is complete.
            _write_affected(measured.affected, directory / DEFECTS / path.name)
            write_survey_table(measured.measurements, MEASUREMENT, path)
        if progress is not None:
            progress(orbit_id + 1, settings.orbits)


def read_affected(directory: Path) -> pd.DataFrame:
    """Return what the defects of a simulated survey changed, all orbits and the catalogue.

    It is the answer that a test of a diagnostic compares with; no fit and no verdict reads it.

    Returns
    -------
    `defect_schema.AFFECTED`; empty without such defects

    Raises
    ------
    InputError
        If a file is not as it was written.
    """
    paths = sorted((Path(directory) / DEFECTS).glob("*.parquet"))
    parts = [read_survey_table(path, AFFECTED) for path in paths]
    return pd.concat([none_affected(), *parts], ignore_index=True)


def _write_affected(affected: pd.DataFrame, path: Path) -> None:
    if len(affected):
        with writing(path.parent, "to make the directory"):
            path.parent.mkdir(exist_ok=True)
        write_survey_table(affected, AFFECTED, path)


def _header(
    settings: SurveySettings, instrument: Instrument, catalogue: Path | None
) -> dict[str, object]:
    content = {"versions": versions_of(_PACKAGES), "settings": settings.to_dict()}
    if catalogue is not None:
        content["catalogue"] = {"name": Path(catalogue).name, "sha256": sha256_of(catalogue)}
    return {**content, "instrument": write_instrument(instrument)}


def _make(directory: Path) -> None:
    if directory.exists() and not directory.is_dir():
        raise InputError(f"{directory}: expected a directory for the survey, found a file")
    with writing(directory, "to make the directory"):
        directory.mkdir(parents=True, exist_ok=True)


def _claim(directory: Path, header: Mapping[str, object]) -> None:
    """Mark `directory` as this survey, unfinished; reject it if it contains anything else."""
    for folder in (directory, directory / MEASUREMENTS, directory / DEFECTS):
        remove_abandoned(folder)
    names = [path.name for path in directory.iterdir() if not is_scratch(path.name)]
    if (directory / HEADER).exists():
        raise InputError(f"{directory}: expected no survey there yet, found a finished one")
    if (directory / UNFINISHED).exists():
        _check_same(directory, header)
    elif names:
        raise InputError(
            f"{directory}: expected an empty directory or an unfinished survey, found {min(names)}"
        )
    write_header(directory, header, UNFINISHED)
    with writing(directory / MEASUREMENTS, "to make the directory"):
        (directory / MEASUREMENTS).mkdir(exist_ok=True)


def _check_same(directory: Path, header: Mapping[str, object]) -> None:
    """Reject an unfinished survey that was started with other settings."""
    started = read_header(directory, UNFINISHED)
    wanted, found = (
        {
            **section(content, "settings"),
            "instrument": content.get("instrument"),
            "catalogue": content.get("catalogue"),
        }
        for content in (header, started)
    )
    different = [name for name in {**wanted, **found} if wanted.get(name) != found.get(name)]
    if different:
        raise InputError(
            f"{directory / UNFINISHED}: expected the settings with which this survey was started, "
            f"found other {', '.join(different)}"
        )


def _truth(settings: SurveySettings, catalogue: Path | None) -> pd.DataFrame:
    if catalogue is None:
        return truth_catalogue(settings)
    located = find_catalogue(Path(catalogue))
    return truth_from_gaia(located.table, settings, located.where)


def _check_seen(measurements: pd.DataFrame, truth: pd.DataFrame, orbit_id: int) -> None:
    references = truth["source_id"][truth["is_reference"]]
    if not measurements["source_id"].isin(references).any():
        count = measurements["source_id"].nunique()
        raise InputError(
            f"orbit {orbit_id}: expected at least one reference star on the detectors, found "
            f"none among {count} {plural(count, 'source')}; more stars are needed"
        )
