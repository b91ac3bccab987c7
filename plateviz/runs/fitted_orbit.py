"""Fitted orbits on disk: one directory each, with Parquet files, either complete or absent.

No user interface and no JAX. A directory is written in a scratch folder, with the file
`COMPLETE` last, and then moved; it is never changed afterwards. `COMPLETE` is a manifest of the
other files, and a file that is not the one it lists is not read. The times, which differ between
repeated fits of the same bytes, are not in it; their file has a SHA-256 of its own.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from solver.data.instrument import instrument_from, instrument_text
from solver.data.result import FitResult
from solver.data.schema import RESULT_TABLES, TRACE, Table
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.atomic import flush
from solver.io.disk import writing
from solver.io.failures import reading
from solver.io.manifest import (
    UnchangedFiles,
    changes,
    manifest_of,
    read_manifest,
    require_digest,
    require_unchanged,
)
from solver.io.parquet import read_frame, write_parquet
from solver.io.scratch import scratch_beside
from solver.io.settings import parse_settings

FORMAT = 1
_COMPLETE = "COMPLETE"
_HEAD = "result.json"
# In a separate file, so that repeated fits differ in this file only.
_TIMINGS = "timings.json"
_REMEDY = "`plateviz survey` with --repair fits the orbit again"


def write_fitted_orbit(
    directory: Path, result: FitResult, beside: Mapping[str, pd.DataFrame] | None = None
) -> None:
    """Write one fitted orbit; one that is complete is not changed.

    Parameters
    ----------
    directory : to write; its parent is created if needed
    beside : additional tables to store with it, by name

    Raises
    ------
    DiskError
        If the disk is full or takes no file for another reason.
    InputError
        If writing fails otherwise.
    """
    with writing(directory, "to write the fitted orbit"):
        directory.parent.mkdir(parents=True, exist_ok=True)
        with scratch_beside(directory) as staging:
            staging.mkdir()
            _write_tables(staging, result, beside or {})
            _write_head(staging, result)
            for path in staging.iterdir():
                flush(path)
            names = {path.name for path in staging.iterdir()} - {_TIMINGS}
            manifest = manifest_of(staging, names)
            (staging / _COMPLETE).write_text(manifest, encoding="utf-8")
            flush(staging / _COMPLETE)
            flush(staging)
            if directory.exists() and not is_complete(directory):
                # A directory appears as a whole: this one has been damaged since.
                remove_fitted_orbit(directory)
            if not directory.exists():
                _move(staging, directory)
                flush(directory.parent)


def remove_fitted_orbit(directory: Path) -> None:
    """Remove a fitted orbit, which is absent for readers from the first moment on."""
    with writing(directory, "to remove the fitted orbit"), scratch_beside(directory) as doomed:
        directory.rename(doomed)


def read_fitted_orbit(directory: Path, remedy: str = _REMEDY) -> FitResult:
    """Read one fitted orbit.

    Parameters
    ----------
    remedy : what to do about a damaged file, a sentence without its full stop

    Raises
    ------
    InputError
        If the directory is not a complete fitted orbit, a file in it is damaged, or it was
        written by a newer version.
    """
    if not is_complete(directory):
        raise InputError(
            f"{directory}: expected a complete fitted orbit, found no {_COMPLETE} file in it"
        )
    manifest = read_manifest(directory / _COMPLETE)
    for name, digest in manifest.items():
        require_unchanged(directory / name, digest, remedy)
    head, timings = _read_json(directory / _HEAD), _read_timings(directory, remedy)
    with reading(str(directory), "a fitted orbit"):
        if head["format"] > FORMAT:
            raise InputError(
                f"{directory}: expected a fitted orbit of format {FORMAT} or older, found "
                f"{head['format']}; it was written by a newer plateviz"
            )
        tables = {table.name: _read_table(directory, table) for table in RESULT_TABLES}
        trace = read_frame(directory / "trace.parquet")
        tables["trace"] = trace.assign(seconds=timings["trace"])[TRACE.names]
        return FitResult(
            **tables,  # type: ignore[arg-type]
            summary={**head["summary"], "seconds": timings["seconds"]},
            settings=parse_settings(head["settings"], str(directory / _HEAD)),
            provenance=head["provenance"],
            instrument=instrument_from(head.get("instrument"), directory / _HEAD),
        )


def read_summary(directory: Path) -> dict[str, Any]:
    """Return the summary of a complete fitted orbit, with its `seconds`.

    Raises
    ------
    InputError
        If its files are damaged.
    """
    wanted = read_manifest(directory / _COMPLETE).get(_HEAD)
    require_unchanged(directory / _HEAD, wanted, _REMEDY)
    head, timings = _read_json(directory / _HEAD), _read_timings(directory)
    with reading(str(directory), "the summary of a fitted orbit"):
        return {**head["summary"], "seconds": timings["seconds"]}


def read_provenance(directory: Path) -> dict[str, str]:
    """Return name -> SHA-256 of the inputs of a complete fitted orbit; raises as `read_summary`."""
    wanted = read_manifest(directory / _COMPLETE).get(_HEAD)
    require_unchanged(directory / _HEAD, wanted, _REMEDY)
    head = _read_json(directory / _HEAD)
    with reading(str(directory), "the inputs of a fitted orbit"):
        return {str(name): str(digest) for name, digest in head["provenance"].items()}


def read_settings(directory: Path) -> FitSettings:
    """Return the settings of a complete fitted orbit; InputError if its files are damaged."""
    wanted = read_manifest(directory / _COMPLETE).get(_HEAD)
    require_unchanged(directory / _HEAD, wanted, _REMEDY)
    with reading(str(directory), "the settings of a fitted orbit"):
        head = _read_json(directory / _HEAD)
        return parse_settings(head["settings"], str(directory / _HEAD))


def kept_table(directory: Path, name: str, unchanged: UnchangedFiles) -> Path:
    """Return the file of one table of a fitted orbit, after checking that it is unchanged.

    Parameters
    ----------
    unchanged : files that need not be checked again

    Raises
    ------
    InputError
        If the table is missing or damaged.
    """
    path = directory / f"{name}.parquet"
    unchanged.require(path, read_manifest(directory / _COMPLETE).get(path.name), _REMEDY)
    return path


def orbit_changes(directory: Path) -> list[str]:
    """Return a message for each file of a fitted orbit that is not as it was written."""
    if not is_complete(directory):
        return [f"{directory / _COMPLETE}: the manifest of a fitted orbit is missing; {_REMEDY}"]
    found = list(changes(directory, directory / _COMPLETE, _REMEDY))
    try:
        _read_timings(directory)
    except InputError as error:
        found.append(str(error))
    return found


def is_complete(directory: Path) -> bool:
    """Return whether a directory is a complete fitted orbit."""
    return (directory / _COMPLETE).is_file()


def _write_tables(directory: Path, result: FitResult, beside: Mapping[str, pd.DataFrame]) -> None:
    tables = {table.file or table.name: getattr(result, table.name) for table in RESULT_TABLES}
    tables["trace"] = result.trace.drop(columns="seconds")
    for name, frame in {**tables, **beside}.items():
        if frame is not None:
            content = pa.Table.from_pandas(frame, preserve_index=False)
            write_parquet(content, directory / f"{name}.parquet")


def _write_head(directory: Path, result: FitResult) -> None:
    summary = dict(result.summary)
    timings = {"seconds": summary.pop("seconds"), "trace": result.trace["seconds"].tolist()}
    head = {
        "format": FORMAT,
        "settings": result.settings.to_dict(),
        "summary": summary,
        "provenance": dict(result.provenance),
        "instrument": instrument_text(result.instrument),
    }
    timings["sha256"] = _digest(timings)
    for name, content in ((_HEAD, head), (_TIMINGS, timings)):
        (directory / name).write_text(json.dumps(content, indent=1), encoding="utf-8")


def _read_table(directory: Path, table: Table) -> pd.DataFrame | None:
    path = directory / f"{table.file or table.name}.parquet"
    return table.completed(read_frame(path)) if path.is_file() else None


def _read_timings(directory: Path, remedy: str = _REMEDY) -> dict[str, Any]:
    path = directory / _TIMINGS
    with reading(str(path), "the times of a fit"):
        timings = dict(_read_json(path))
        # Older versions wrote none.
        require_digest(path, _digest(timings), timings.pop("sha256", None), remedy)
        return timings


def _digest(timings: Mapping[str, Any]) -> str:
    content = {name: value for name, value in timings.items() if name != "sha256"}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _read_json(path: Path) -> Any:  # noqa: ANN401 whatever the file holds
    with reading(str(path), "JSON"):
        return json.loads(path.read_text(encoding="utf-8"))


def _move(staging: Path, directory: Path) -> None:
    """Rename a directory; one that another process has written in the meantime is kept."""
    try:
        staging.rename(directory)
    except OSError:
        if not is_complete(directory):
            raise
