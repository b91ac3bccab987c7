"""Inspection of files: kind, contents and problems of each file."""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
from astropy.table import Column as RawColumn
from astropy.table import Table as RawTable
from astropy.time import Time

from solver.data.instrument import read_instrument
from solver.data.schema import CATALOGUE, ENVIRONMENT, MEASUREMENT, TRUTH, Table
from solver.errors import InputError
from solver.io.consistency import (
    catalogue_problems,
    exposure_problems,
    place_problems,
    truth_problems,
)
from solver.io.fits import read_fits
from solver.io.formats import has_reader, is_fits, place, read_tables
from solver.io.parquet import count_rows
from solver.io.read_orbit import names_of
from solver.io.result import is_result, to_result
from solver.io.survey import measurement_path, survey_orbits
from solver.io.survey_header import UNFINISHED, found_unfinished, read_header, section
from solver.io.survey_manifest import survey_changes
from solver.io.survey_problems import survey_problems
from solver.io.table_check import examine, matched_names

_INPUTS = (MEASUREMENT, ENVIRONMENT, CATALOGUE, TRUTH)
_MIN_COLUMN_SHARE = 0.5
_ONLY_IN_A_TRUTH = {"ra_epoch", "dec_epoch"}
_SURVEY_TABLES = {
    "reference.parquet": CATALOGUE,
    "truth.parquet": TRUTH,
    "exposures.parquet": ENVIRONMENT,
}


@dataclass
class _Finding:
    """A file being inspected; `frames` are its usable tables as (kind, location, rows)."""

    path: Path
    kind: str = "unknown"
    tables: list[dict] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    defects: list[str] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    frames: list[tuple[Table, str, pd.DataFrame]] = field(default_factory=list)


def inspect_files(paths: Iterable[Path]) -> list[dict]:
    """Describe files and list their problems; an invalid file does not raise.

    Measurements are also checked against the environment, catalogue and truth among the
    files; problems of this check are listed with the measurements.

    Parameters
    ----------
    paths : files and folders

    Returns
    -------
    One dictionary per path, which can be written as JSON: `file`; `kind` ("observation",
    "measurement", "environment", "catalogue", "truth", "result", "instrument", "survey" or
    "unknown"); `tables`, each with `name`, `file`, `kind`, `rows` and `columns` (`name`,
    `unit`, `type`, `min`, `max`, and `canonical`, the name it is read as, or None); `defects`,
    those that a survey was simulated with; `counts` of the `orbits` of a survey and of its
    `measurements`, as far as their files can be read; `problems`.
    """
    findings = [_inspect(Path(path)) for path in paths]
    _cross_check(findings)
    return [
        {
            "file": str(finding.path),
            "kind": finding.kind,
            "tables": finding.tables,
            "defects": finding.defects,
            "counts": finding.counts,
            "problems": finding.problems,
        }
        for finding in findings
    ]


def _inspect(path: Path) -> _Finding:
    finding = _Finding(path)
    try:
        if path.is_dir():
            _inspect_folder(finding)
        elif path.suffix.lower() == ".toml":
            finding.kind = "instrument"
            read_instrument(path)
        else:
            _inspect_file(finding)
    except (InputError, OSError) as error:
        finding.problems.append(str(error))
    return finding


def _inspect_folder(finding: _Finding) -> None:
    files = [p for p in sorted(finding.path.iterdir()) if has_reader(p) and p.is_file()]
    if (finding.path / UNFINISHED).is_file():
        finding.kind = "unfinished survey"
        finding.problems.append(
            f"{finding.path}: expected a survey, found {found_unfinished(finding.path)}"
        )
        return
    if (finding.path / "survey.toml").is_file():
        for path in files:
            if path.name in _SURVEY_TABLES:
                _inspect_in_folder(finding, path, _SURVEY_TABLES[path.name])
        finding.kind = "survey"
        finding.problems += [*survey_changes(finding.path), *survey_problems(finding.path)]
        finding.defects = _defects_of(finding.path)
        finding.counts = _counts_of(finding.path)
        return
    for path in files:
        _inspect_in_folder(finding, path)
    if not files:
        finding.problems.append(
            f"{finding.path}: expected a survey or the tables of an observation, "
            "found a folder without either"
        )


def _defects_of(survey: Path) -> list[str]:
    """Return the defects in a survey's header; none where it is damaged."""
    try:
        defects = section(read_header(survey), "settings").get("defects")
    except InputError:
        return []
    return [str(one) for one in defects] if isinstance(defects, list) else []


def _counts_of(survey: Path) -> dict[str, int]:
    """Return how many orbits a survey has, and measurements; nothing where it is damaged."""
    try:
        orbits = survey_orbits(survey)
    except InputError:
        return {}
    n_rows = 0
    for orbit in orbits:
        # What is wrong with the file is among the problems.
        with suppress(InputError):
            n_rows += count_rows(str(measurement_path(survey, orbit)))
    return {"orbits": len(orbits), "measurements": n_rows}


def _inspect_file(finding: _Finding) -> None:
    path = finding.path
    if not is_fits(path) or not path.is_file():
        _inspect_tables(finding, path, read_tables(path))
        return
    file = read_fits(path)
    if not is_result(file.primary):
        _inspect_tables(finding, path, file.tables)
        return
    finding.kind = "result"
    finding.tables = [_describe(path, name, table, None) for name, table in file.tables.items()]
    to_result(path, file)


def _inspect_in_folder(finding: _Finding, path: Path, known: Table | None = None) -> None:
    try:
        _inspect_tables(finding, path, read_tables(path), known)
    except InputError as error:
        finding.problems.append(str(error))


def _inspect_tables(
    finding: _Finding, path: Path, tables: dict[str, RawTable], known: Table | None = None
) -> None:
    kinds = {name: known or _recognise(path, name, table) for name, table in tables.items()}
    for name, table in tables.items():
        finding.tables.append(_describe(path, name, table, kinds[name]))
        if (kind := kinds[name]) is not None:
            where = place(path, name)
            frame, problems = examine(table, kind, where)
            finding.problems += problems
            if kind is MEASUREMENT:
                finding.problems += place_problems(frame, where)
            finding.frames.append((kind, where, frame))
    finding.kind = _overall([kind.name for kind, _, _ in finding.frames])
    if not any(kinds.values()):
        finding.problems.append(
            f"{path}: expected measurements, an environment, a catalogue or a truth, "
            f"found {', '.join(tables) or 'no table'} with other columns"
        )


def _recognise(path: Path, name: str, table: RawTable) -> Table | None:
    named = {n: kind for kind in reversed(_INPUTS) for n in names_of(kind)}
    shares = {kind.name: _share(table, kind) for kind in _INPUTS}
    kind = named.get(name.lower())
    if kind is None or shares[kind.name] == 0.0:
        kind = max(_INPUTS, key=lambda k: shares[k.name])
        if shares[kind.name] < _MIN_COLUMN_SHARE:
            return None
    if kind in (CATALOGUE, TRUTH):
        is_named_truth = "truth" in f"{path.stem} {name}".lower()
        return TRUTH if is_named_truth or _ONLY_IN_A_TRUTH & set(table.colnames) else CATALOGUE
    return kind


def _share(table: RawTable, kind: Table) -> float:
    required = [column.name for column in kind if column.required]
    names = matched_names(table.colnames, kind)
    return sum(name in names for name in required) / len(required)


def _overall(kinds: list[str]) -> str:
    if {"measurement", "environment"} <= set(kinds):
        return "observation"
    return kinds[0] if kinds else "unknown"


def _describe(path: Path, name: str, table: RawTable, kind: Table | None) -> dict:
    matched = matched_names(table.colnames, kind) if kind else {}
    canonical = {found: wanted for wanted, found in matched.items()}
    return {
        "name": name,
        "file": str(path),
        "kind": kind.name if kind else None,
        "rows": len(table),
        "columns": [
            _describe_column(name, table[name], canonical.get(name)) for name in table.colnames
        ],
    }


def _describe_column(name: str, column: RawColumn | Time, canonical: str | None) -> dict:
    unit = getattr(column, "unit", None)
    low, high = _range(column)
    return {
        "name": name,
        "unit": "" if unit is None else str(unit),
        "type": "time" if isinstance(column, Time) else str(getattr(column, "dtype", "object")),
        "min": low,
        "max": high,
        "canonical": canonical,
    }


def _range(column: RawColumn | Time) -> tuple[float | int | str | None, float | int | str | None]:
    if isinstance(column, Time):
        return (str(column.min().isot), str(column.max().isot)) if column.size else (None, None)
    values = np.ma.asarray(column).compressed()
    if values.dtype.kind not in "iuf":
        return None, None
    values = values[np.isfinite(values)]
    return (values.min().item(), values.max().item()) if values.size else (None, None)


def _cross_check(findings: list[_Finding]) -> None:
    for finding in findings:
        for kind, where, measured in finding.frames:
            if kind is MEASUREMENT:
                finding.problems += _cross_check_problems(measured, where, [finding, *findings])


def _cross_check_problems(
    measured: pd.DataFrame, where: str, findings: list[_Finding]
) -> list[str]:
    problems: list[str] = []
    seen: set[str] = set()
    others = (frame for finding in findings for frame in finding.frames)
    for kind, where_other, other in others:
        if kind is MEASUREMENT or where_other in seen:
            continue
        seen.add(where_other)
        check = _CROSS_CHECKS[kind.name]
        needed = {"source_id", "is_reference"} if kind is CATALOGUE else set(kind.key)
        if needed <= set(other.columns) and set(MEASUREMENT.key) <= set(measured.columns):
            problems += check(measured, other, where, where_other)
    return problems


_CROSS_CHECKS = {
    "environment": exposure_problems,
    "catalogue": catalogue_problems,
    "truth": truth_problems,
}
