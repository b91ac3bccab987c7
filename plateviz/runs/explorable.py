"""Tables of a run whose columns can be drawn against each other, of which little is in memory.

The measurements of a run are tens of millions of rows. Of them and of the sources per orbit, only
columns that are asked for are read, and kept as long as others are not asked for.
"""

from collections.abc import Callable, Hashable, Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd

from plateviz.runs.column_cache import ColumnCache
from plateviz.runs.file_rows import DerivedColumn, FileRows, RowKind
from plateviz.runs.run import Run
from plateviz.runs.run_directory import RunDirectory
from plateviz.tables.explore import (
    CHI2_PER_DOF,
    OF_DEVIATION,
    OF_MEASUREMENTS,
    CodedSources,
    ExplorableTable,
    FittedColumn,
    explorable,
    fitted_columns,
    numbers_of,
)
from plateviz.tables.exposures import minutes_since_first
from plateviz.tables.labels import exposure_labels
from plateviz.tables.sources import chi2_per_dof, class_names
from solver.data.columns import Column, Table
from solver.data.parameters import PARAMETERS
from solver.data.schema import EXPOSURE_KEY, EXPOSURES, RESIDUALS
from solver.data.survey_schema import HISTORY, MOTIONS, RUN_ORBITS
from solver.errors import InputError
from solver.io.parquet import count_rows, read_columns

MOST_ROWS = 2**25
"""Of more measurements, those of one orbit in two or in more are shown."""

_EXPOSURES, _CALIBRATION = "exposures.parquet", "calibration.parquet"
_SOURCES = "sources.parquet"
_ADDED = {column.name: column for column in (*OF_MEASUREMENTS, *OF_DEVIATION)}


def _per_exposure(name: str) -> Callable[[Mapping[str, np.ndarray], Path], np.ndarray]:
    """Return the function that computes a number of the exposure of each measurement."""

    def compute(columns: Mapping[str, np.ndarray], folder: Path) -> np.ndarray:
        keys = ["field_id", "plate_id"]
        exposures = read_columns(folder / _EXPOSURES, [*keys, "obstime"]).to_pandas()
        exposures["minutes"] = minutes_since_first(exposures)
        of_key = exposures.set_index(keys)[name]
        wanted = pd.MultiIndex.from_arrays([columns[key] for key in keys])
        return of_key.reindex(wanted).to_numpy()

    return compute


def _fitted(one: FittedColumn) -> DerivedColumn:
    """Return the column of a parameter of the exposures, NaN where an orbit does not fit it."""

    def compute(columns: Mapping[str, np.ndarray], folder: Path) -> np.ndarray:
        rows = read_columns(folder / _CALIBRATION, ["group", "element", one.kind]).to_pandas()
        rows = rows[rows["group"] == one.group].set_index("element")
        return rows[one.kind].reindex(range(len(columns["plate_id"]))).to_numpy()

    return DerivedColumn(one.column, ("plate_id",), compute)


def _n_obs(columns: Mapping[str, np.ndarray], _: Path) -> np.ndarray:
    codes, _ = pd.factorize(columns["source_id"])
    return np.bincount(codes)[codes]


def _magnitude(columns: Mapping[str, np.ndarray], folder: Path) -> np.ndarray:
    sources = read_columns(folder / _SOURCES, ["source_id", "magnitude"]).to_pandas()
    return sources.set_index("source_id")["magnitude"].reindex(columns["source_id"]).to_numpy()


def _phase(axis: str) -> DerivedColumn:
    name = f"n{axis}"
    return DerivedColumn(_ADDED[f"phase_{axis}"], (name,), lambda c, _: c[name] - np.floor(c[name]))


def _deviation(axis: str) -> DerivedColumn:
    needs = estimate, true = f"offset_{axis}", f"true_offset_{axis}"
    return DerivedColumn(_ADDED[f"deviation_{axis}_mas"], needs, lambda c, _: c[estimate] - c[true])


def _pull(axis: str) -> DerivedColumn:
    needs = estimate, true, sigma = (
        f"offset_{axis}",
        f"true_offset_{axis}",
        f"sigma_{axis}_marginal",
    )
    return DerivedColumn(
        _ADDED[f"pull_{axis}"], needs, lambda c, _: (c[estimate] - c[true]) / c[sigma]
    )


_MEASUREMENTS = RowKind(
    RESIDUALS,
    (
        DerivedColumn(
            _ADDED["standardised"],
            ("standardised_x", "standardised_y"),
            lambda c, _: np.hypot(c["standardised_x"], c["standardised_y"]),
        ),
        _phase("x"),
        _phase("y"),
        DerivedColumn(_ADDED["n_obs"], ("source_id",), _n_obs),
        DerivedColumn(_ADDED["magnitude"], ("source_id",), _magnitude),
        DerivedColumn(_ADDED["minutes"], ("field_id", "plate_id"), _per_exposure("minutes")),
        DerivedColumn(EXPOSURES["obstime"], ("field_id", "plate_id"), _per_exposure("obstime")),
    ),
    is_single=True,
    precise=("obstime",),
)
_CHI2_PER_DOF = DerivedColumn(
    CHI2_PER_DOF, ("chi2", "dof"), lambda c, _: chi2_per_dof(pd.DataFrame(c))
)
_EXPOSURE_ROWS = RowKind(
    EXPOSURES,
    (
        DerivedColumn(
            _ADDED["minutes"], ("obstime",), lambda c, _: minutes_since_first(pd.DataFrame(c))
        ),
        _CHI2_PER_DOF,
        *map(_fitted, fitted_columns([one for one in PARAMETERS if one.axis == "exp"])),
    ),
    is_single=False,
)
_HISTORY = RowKind(
    HISTORY,
    (
        _CHI2_PER_DOF,
        *map(_deviation, ("ra", "dec")),
        *map(_pull, ("ra", "dec")),
    ),
    is_single=False,
)


def _columns(table: Table, added: tuple[Column, ...] = ()) -> Mapping[str, Column]:
    orbit = [table["orbit_id"]] if "orbit_id" in table.names else []
    return MappingProxyType({one.name: one for one in (*numbers_of(table), *orbit, *added)})


COLUMNS_OF_RUN: Mapping[str, Mapping[str, Column]] = MappingProxyType(
    {
        "measurements": _columns(RESIDUALS, tuple(one.column for one in _MEASUREMENTS.derived)),
        "exposures": _columns(EXPOSURES, tuple(one.column for one in _EXPOSURE_ROWS.derived)),
        "sources per orbit": _columns(HISTORY, tuple(one.column for one in _HISTORY.derived)),
        "motions": _columns(MOTIONS, (CHI2_PER_DOF,)),
        "orbits": _columns(RUN_ORBITS),
    }
)
"""What a row is -> name -> definition of the columns of a run that are numbers."""


def explorable_of_run(run: Run, rows: str, kept: ColumnCache) -> ExplorableTable:
    """Return a table of a run.

    Parameters
    ----------
    rows : what a row is, a key of `COLUMNS_OF_RUN`
    kept : keeps the columns that were read

    Raises
    ------
    InputError
        If the run is gone, or a file missing or damaged; also from the methods of the table.
    """
    if not run.is_there():
        raise InputError(f"the run {run.name} is not on the disk any more")
    if rows == "motions":
        motions = run.motions()
        added = {"chi2_per_dof": chi2_per_dof(motions), "source_class": class_names(motions)}
        return explorable(rows, motions.assign(**added), MOTIONS, [CHI2_PER_DOF])
    if rows == "orbits":
        return _orbits(run)
    if rows == "exposures":
        return _exposures(run, kept)
    return _measurements(run, kept) if rows == "measurements" else _history(run, kept)


def _orbits(run: Run) -> ExplorableTable:
    frame = run.orbits()
    names = frame["orbit_id"].astype(str).to_numpy()
    orbit = RUN_ORBITS["orbit_id"]
    return explorable("orbits", frame, RUN_ORBITS, [orbit], {"orbit_id": names.__getitem__})


def _exposures(run: Run, kept: ColumnCache) -> ExplorableTable:
    of_run = RunDirectory(run.survey, run.name)
    files = [of_run.orbit_directory(orbit) / _EXPOSURES for orbit in of_run.complete_orbits()]
    rows = FileRows(_EXPOSURE_ROWS, files, _state(files), kept)

    def keys(numbers: np.ndarray) -> pd.DataFrame:
        return pd.DataFrame({name: rows.read(name)[numbers].astype(int) for name in EXPOSURE_KEY})

    return ExplorableTable(
        "exposures",
        rows.size,
        COLUMNS_OF_RUN["exposures"],
        rows.read,
        has_sources=False,
        has_classes=False,
        words={
            "orbit_id": lambda numbers: keys(numbers)["orbit_id"].astype(str).to_numpy(),
            "exposure": lambda numbers: exposure_labels(keys(numbers)).to_numpy(),
        },
    )


def _measurements(run: Run, kept: ColumnCache) -> ExplorableTable:
    of_run = RunDirectory(run.survey, run.name)
    every, orbits = _thinned(of_run)
    files = [of_run.orbit_directory(orbit) / "residuals.parquet" for orbit in orbits]
    rows = FileRows(_MEASUREMENTS, files, _state(files), kept)
    names = np.array(orbits).astype(str)

    def orbit_of(numbers: np.ndarray) -> np.ndarray:
        return names[np.searchsorted(rows.starts, numbers, side="right") - 1]

    note = f"those of one orbit in {every}, which fit into the memory" if every > 1 else ""
    return _of_files("measurements", rows, run, orbit_of)._replace(note=note)


def _history(run: Run, kept: ColumnCache) -> ExplorableTable:
    files = list(map(Path, run.history_files()))
    rows = FileRows(_HISTORY, files, _state(files), kept)
    return _of_files(
        "sources per orbit",
        rows,
        run,
        lambda numbers: rows.read("orbit_id")[numbers].astype(int).astype(str),
    )


def _of_files(
    name: str, rows: FileRows, run: Run, orbit_of: Callable[[np.ndarray], np.ndarray]
) -> ExplorableTable:
    @cache
    def classes() -> np.ndarray:
        known = run.counts().set_index("source_id")[["is_reference", "is_artificial"]]
        return class_names(known.reindex(rows.sources()[0], fill_value=False))

    def coded() -> CodedSources:
        ids, codes = rows.sources()
        return CodedSources(ids, codes, classes())

    return ExplorableTable(
        name,
        rows.size,
        COLUMNS_OF_RUN[name],
        rows.read,
        has_sources=True,
        has_classes=True,
        words={"orbit": orbit_of},
        coded=coded,
    )


def _thinned(run: RunDirectory) -> tuple[int, list[int]]:
    """Return n, and every nth fitted orbit, so that the measurements are not too many."""
    orbits = run.complete_orbits()
    if not orbits:
        return 1, []
    largest = count_rows(str(run.orbit_directory(orbits[0]) / "residuals.parquet"))
    every = -(-len(orbits) * largest // MOST_ROWS) or 1
    return every, orbits[::every]


def _state(files: list[Path]) -> Hashable:
    """Return what differs if any of the files is another one."""
    found = []
    for path in files:
        status = path.stat() if path.is_file() else None
        found.append((path, status and (status.st_ino, status.st_size, status.st_mtime_ns)))
    return tuple(found)
