"""The tables from which a run as a whole is tested, computed from its orbits when all are fitted.

Like the other tables over all orbits they are written once. They are small: no test reads the
orbits again.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa

from plateviz.runs.fitted_orbit import read_summary
from plateviz.runs.run_directory import HISTORY_FILE, RunDirectory
from solver.data.columns import Table
from solver.data.run_schema import (
    CALIBRATIONS,
    ORBIT_CAUSES,
    ORBIT_TESTS,
    SKY_RESPONSES,
    SKY_STATISTICS,
    ZONAL_FIELD,
)
from solver.io.atomic import write_atomically
from solver.io.parquet import read_frame, write_parquet
from solver.model.directions import places_about
from solver.results.diagnosis.survey.calibrations import orbit_calibration
from solver.results.diagnosis.survey.frames import compare_frames
from solver.results.diagnosis.survey.sky_orbit import OrbitTables, common_centre, sky_orbits
from solver.results.diagnosis.survey.zonal import LEAST_ORBITS, zonal_field, zonal_test

_OF_FRAMES = (
    *("source_id", "orbit_id", "epoch", "is_reference", "ra", "dec", "offset_ra", "offset_dec"),
    *("sigma_ra_conditional", "sigma_dec_conditional", "corr_conditional"),
)
_NO_CAUSE = {
    **dict.fromkeys(("name", "title", "words", "spoils", "action"), ""),
    "significance": 0.0,
}


def write_test_tables(run: RunDirectory) -> None:
    """Write `run_schema.RUN_TABLES` of the fitted orbits of a run, whose history is gathered."""
    orbits = run.complete_orbits()
    summaries = {orbit: read_summary(run.orbit_directory(orbit)) for orbit in orbits}
    calibrations = [
        orbit_calibration(
            read_frame(run.orbit_directory(orbit) / "calibration.parquet"),
            orbit,
            float(summary["epoch_mjd"]),
        )
        for orbit, summary in summaries.items()
    ]
    tests, causes = [], []
    for orbit, summary in summaries.items():
        # Orbits of older versions have none: they are not known to be good.
        verdict = summary.get("verdict")
        if not verdict:
            continue
        for test in verdict.get("tests", []):
            tests.append({"orbit_id": orbit, "name": test["name"], "sigma": test["sigma"]})
        causes += [{"orbit_id": orbit, **row} for row in _causes(verdict)]
    _write(run, CALIBRATIONS, pd.concat(calibrations, ignore_index=True))
    _write(run, ORBIT_TESTS, pd.DataFrame(tests, columns=ORBIT_TESTS.names))
    _write(run, ORBIT_CAUSES, pd.DataFrame(causes, columns=ORBIT_CAUSES.names))
    _write(run, ZONAL_FIELD, _zonal(run, summaries))


def _causes(verdict: dict) -> Iterator[dict]:
    """Yield the causes of an orbit's verdict, or one row without a cause."""
    state = str(verdict["state"])
    causes = verdict.get("causes") or [{**_NO_CAUSE, "options": (), "is_large": False}]
    # One that another may be in place of does not make many orbits name it.
    for cause in (one for one in causes if not one.get("instead_of")):
        plain = {name: cause[name] for name in ORBIT_CAUSES.names if name in cause}
        yield {**plain, "state": state, "options": "\n".join(cause["options"])}


def _zonal(run: RunDirectory, summaries: dict[int, dict]) -> pd.DataFrame:
    """Return `ZONAL_FIELD`; no rows for too few orbits, or orbits of older versions."""
    found = {}
    for orbit, summary in summaries.items():
        files = [_sky_file(run, orbit, table) for table in (SKY_STATISTICS, SKY_RESPONSES)]
        if all(file.is_file() for file in files):
            statistics, responses = map(read_frame, files)
            found[orbit] = OrbitTables(float(summary["epoch_mjd"]), statistics, responses)
    # Those with other settings of the distortion cannot be compared; a run has one.
    if len(found) < LEAST_ORBITS:
        return pd.DataFrame(columns=ZONAL_FIELD.names)
    tables = [*found.values()]
    centre = common_centre(tables)
    history = read_frame(run.directory / HISTORY_FILE, list(_OF_FRAMES))
    history = history[history["orbit_id"].isin(found)]
    places = places_about(centre, *history[["ra", "dec"]].to_numpy().T)
    # That of a uniform distribution with this scatter.
    half_width = np.sqrt(3.0) * places.std(axis=0)
    frames = compare_frames(history, np.array([*found]), centre)
    zonal = zonal_test(sky_orbits(tables, centre), frames, half_width)
    return zonal_field(zonal, centre)


def _sky_file(run: RunDirectory, orbit: int, table: Table) -> Path:
    return run.orbit_directory(orbit) / f"{table.name}.parquet"


def _write(run: RunDirectory, table: Table, frame: pd.DataFrame) -> None:
    with write_atomically(run.directory / f"{table.name}.parquet") as temporary:
        content = pa.Table.from_pandas(frame[table.names], preserve_index=False)
        write_parquet(content, temporary)
