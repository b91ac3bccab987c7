"""Seed files of the campaign of mutated files: small, of every kind, made without a fit."""

import lzma
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
from astropy.io import fits
from astropy.table import Table as RawTable

from plateviz.runs.gathered_history import gather_history
from plateviz.runs.new_run import begin_run
from plateviz.runs.run_directory import ERRORS_FILE, MOTIONS_FILE, RunDirectory
from solver.data.columns import Table
from solver.data.instrument import MINI_MOCK, write_instrument
from solver.data.orbit import OrbitData
from solver.data.result import FitResult
from solver.data.schema import (
    CATALOGUE,
    ENVIRONMENT,
    LOSSES,
    MEASUREMENT,
    ORDERS,
    OUTLIERS,
    TRUTH,
)
from solver.data.settings import FitSettings
from solver.data.survey_schema import ERRORS_BY_COUNT, HISTORY, MOTIONS
from solver.io.parquet import write_parquet
from solver.io.read_orbit import read_orbit
from solver.io.result import write_result
from solver.io.survey import (
    EXPOSURES,
    MEASUREMENTS,
    REFERENCE,
    TRUTH_FILE,
    measurement_path,
    write_manifest,
    write_survey_table,
)
from solver.io.survey_header import write_header
from tests.solver.io_samples import FIRST_ID, N_SOURCES, random_table, small_result, write_fits

SAMPLE = Path(__file__).resolve().parents[1] / "data"
ORBITS = (0, 1)
RUN = "default"
_SOURCES, _EXPOSURES = 20, 16


def orbit_tables(folder: Path) -> OrbitData:
    """Return a few hundred measurements of the sample orbit, which is unpacked into a folder."""
    for packed in SAMPLE.glob("*.fits.xz"):
        (folder / packed.stem).write_bytes(lzma.decompress(packed.read_bytes()))
    obs, ref, truth = (folder / f"sample_{name}.fits" for name in ("obs", "ref", "truth"))
    whole = read_orbit(obs, ref, truth)
    rows = whole.measurements
    often = rows["source_id"].value_counts().index
    flags = whole.catalogue.set_index("source_id").loc[often, "is_reference"].to_numpy(bool)
    chosen = [*often[flags][: _SOURCES // 2], *often[~flags][: _SOURCES // 2]]
    exposures = whole.exposures.iloc[:: -(-len(whole.exposures) // _EXPOSURES)]
    rows = rows[rows["source_id"].isin(chosen)]
    # The merge numbers the rows anew.
    rows = rows.merge(exposures[list(ENVIRONMENT.key)], on=list(ENVIRONMENT.key))
    measured = rows[list(ENVIRONMENT.key)].drop_duplicates()
    stars, true = (
        table[table["source_id"].isin(chosen)].reset_index(drop=True)
        for table in (whole.catalogue, whole.truth)
    )
    return OrbitData(rows, exposures.merge(measured, on=list(ENVIRONMENT.key)), stars, true)


def _raw(frame: pd.DataFrame, schema: Table) -> RawTable:
    table = RawTable.from_pandas(frame[schema.names])
    for column in schema:
        table[column.name].unit = column.unit or None
    return table


def _raw_tables(orbit: OrbitData) -> dict[str, RawTable]:
    return {
        "measurement": _raw(orbit.measurements, MEASUREMENT),
        "environment": _raw(orbit.exposures, ENVIRONMENT),
        "catalogue": _raw(orbit.catalogue, CATALOGUE),
        "truth": _raw(orbit.truth, TRUTH),
    }


def make_fits(folder: Path, orbit: OrbitData, checksum: bool = True) -> None:
    tables = _raw_tables(orbit)
    files = {"OBS": ("measurement", "environment"), "REF": ("catalogue",), "TRUTH": ("truth",)}
    for name, parts in files.items():
        path = folder / f"{name}.fits"
        write_fits(path, **{part: tables[part] for part in parts})
        if not checksum:
            with fits.open(path) as hdus:
                for hdu in hdus:
                    for card in ("CHECKSUM", "DATASUM"):
                        hdu.header.remove(card, ignore_missing=True)
                hdus.writeto(path, overwrite=True)


def make_plain_fits(folder: Path, orbit: OrbitData) -> None:
    make_fits(folder, orbit, checksum=False)


def make_tables(
    suffix: str, write: Callable[[RawTable, Path], None]
) -> Callable[[Path, OrbitData], None]:
    def make(folder: Path, orbit: OrbitData) -> None:
        for name, table in _raw_tables(orbit).items():
            write(table, folder / f"{name}{suffix}")

    return make


def _write_votable(table: RawTable, path: Path) -> None:
    # The three ways in which a VOTable holds its rows.
    ways = {"measurement": "binary2", "truth": "binary"}
    table.write(path, format="votable", tabledata_format=ways.get(path.stem, "tabledata"))


def _write_parquet(table: RawTable, path: Path) -> None:
    frame = table.to_pandas()
    fields = [
        pa.field(name, pa.Schema.from_pandas(frame).field(name).type).with_metadata(
            {"unit": str(table[name].unit)} if table[name].unit else {}
        )
        for name in table.colnames
    ]
    write_parquet(pa.Table.from_pandas(frame, pa.schema(fields), preserve_index=False), path)


make_ecsv = make_tables(".ecsv", lambda table, path: table.write(path, format="ascii.ecsv"))
make_csv = make_tables(".csv", lambda table, path: table.write(path, format="ascii.csv"))
make_votable = make_tables(".xml", _write_votable)
make_parquet = make_tables(".parquet", _write_parquet)


def sample_result() -> FitResult:
    """Return a result with every table that may be absent, except the eigenmodes."""
    random = np.random.default_rng(4)
    return replace(
        small_result(),
        outliers=random_table(OUTLIERS, 3, random),
        losses=random_table(LOSSES, 5, random),
        orders=random_table(ORDERS, 2, random),
    )


def make_result(folder: Path, orbit: OrbitData) -> None:
    del orbit
    write_result(sample_result(), folder / "RESULT.fits")


def make_instrument(folder: Path, orbit: OrbitData) -> None:
    del orbit
    (folder / "instrument.toml").write_text(write_instrument(MINI_MOCK), encoding="utf-8")


def make_survey(folder: Path, orbit: OrbitData) -> None:
    (folder / MEASUREMENTS).mkdir(parents=True)
    for number in ORBITS:
        rows = orbit.measurements.assign(orbit_id=number)
        write_survey_table(rows, MEASUREMENT, measurement_path(folder, number))
    exposures = pd.concat(
        [
            orbit.exposures.assign(orbit_id=number, obstime=orbit.exposures["obstime"] + number)
            for number in ORBITS
        ]
    )
    write_survey_table(exposures, ENVIRONMENT, folder / EXPOSURES)
    write_survey_table(orbit.catalogue, CATALOGUE, folder / REFERENCE)
    write_survey_table(orbit.truth, TRUTH, folder / TRUTH_FILE)
    header = {
        "versions": {"plateviz": "0"},
        "settings": {"orbits": 2, "field_l_deg": [-1.4, 0.7], "field_b_deg": [-0.6, 0.6]},
        "instrument": write_instrument(MINI_MOCK),
    }
    write_manifest(folder, header)
    write_header(folder, header)


def make_unlisted_survey(folder: Path, orbit: OrbitData) -> None:
    """Make a survey without a manifest, as older versions did."""
    make_survey(folder, orbit)
    (folder / "manifest.sha256").unlink()


def make_run(folder: Path, orbit: OrbitData, complete: bool = True) -> RunDirectory:
    """Make a survey and a run of all its orbits, or of the first only."""
    make_survey(folder, orbit)
    settings = FitSettings(order=3, prior_widths={"detector_x": 2.0})
    run = begin_run(folder, RUN, settings)
    random = np.random.default_rng(5)
    for number in ORBITS if complete else ORBITS[:1]:
        result = sample_result()
        history = random_table(HISTORY, N_SOURCES, random).assign(
            source_id=FIRST_ID + np.arange(N_SOURCES), orbit_id=number
        )
        summary = {**result.summary, "epoch_mjd": 62000.0 + number, "iterations": 3}
        exposures = result.exposures.assign(orbit_id=number)
        changed = {"settings": settings, "summary": summary, "instrument": MINI_MOCK}
        run.keep(number, replace(result, exposures=exposures, **changed), {"history": history})
    if complete:
        _gather(run, random)
        run.mark_complete()
    return run


def _gather(run: RunDirectory, random: np.random.Generator) -> None:
    gather_history(run)
    motions = random_table(MOTIONS, N_SOURCES, random).assign(
        source_id=FIRST_ID + np.arange(N_SOURCES)
    )
    tables = {MOTIONS_FILE: motions, ERRORS_FILE: random_table(ERRORS_BY_COUNT, 3, random)}
    for name, table in tables.items():
        write_parquet(pa.Table.from_pandas(table, preserve_index=False), run.directory / name)
    run.mark_gathered(run.complete_orbits())


def make_interrupted_run(folder: Path, orbit: OrbitData) -> None:
    """Make a run that has an orbit, and no table over all orbits yet."""
    make_run(folder, orbit, complete=False)


def make_failed_run(folder: Path, orbit: OrbitData) -> None:
    """Make a run of which one orbit failed: it has tables over all orbits, and no manifest."""
    run = make_run(folder, orbit, complete=False)
    run.keep_failure(1, "orbit 1: no light")
    _gather(run, np.random.default_rng(6))


def make_address(folder: Path, orbit: OrbitData) -> None:
    """Make a run, and the query of an address that shows a source of it."""
    make_run(folder, orbit)
    query = f"view=source&orbit=1&field=1&plates=0-1&detector=2&run={RUN}&source={FIRST_ID + 1}"
    (folder / "address").write_text(query, encoding="utf-8")
