"""Fitted orbits on disk: one directory each, with Parquet files, either complete or absent.

No user interface and no JAX. A directory is written under a temporary name, with the file
`COMPLETE` last, and then renamed; it is never changed afterwards.
"""

import json
import os
import secrets
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from solver.data.result import FitResult
from solver.data.schema import RESULT_TABLES, TRACE
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.parquet import write_parquet

FORMAT = 1
_COMPLETE = "COMPLETE"
_HEAD = "result.json"
# In a separate file, so that repeated fits differ in this file only.
_TIMINGS = "timings.json"


def write_fitted_orbit(
    directory: Path, result: FitResult, beside: Mapping[str, pd.DataFrame] | None = None
) -> None:
    """Write one fitted orbit; an existing directory is not changed.

    Parameters
    ----------
    directory : to write; its parent is created if needed
    beside : additional tables to store with it, by name
    """
    directory.parent.mkdir(parents=True, exist_ok=True)
    staging = directory.with_name(f".{directory.name}-{secrets.token_hex(6)}")
    staging.mkdir()
    try:
        _write_tables(staging, result, beside or {})
        _write_head(staging, result)
        for path in staging.iterdir():
            _flush(path)
        (staging / _COMPLETE).touch()
        _flush(staging)
        if not directory.exists():
            staging.rename(directory)
            _flush(directory.parent)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def remove_unfinished(folder: Path) -> None:
    """Remove temporary directories that interrupted writes left in a folder."""
    for staging in folder.glob(".*-*"):
        if staging.is_dir():
            shutil.rmtree(staging, ignore_errors=True)


def read_fitted_orbit(directory: Path) -> FitResult:
    """Read one fitted orbit.

    Raises
    ------
    InputError
        If the directory is not a complete fitted orbit, or was written by a newer version.
    """
    if not is_complete(directory):
        raise InputError(
            f"{directory}: expected a complete fitted orbit, found no {_COMPLETE} file in it"
        )
    head = json.loads((directory / _HEAD).read_text(encoding="utf-8"))
    if head["format"] > FORMAT:
        raise InputError(
            f"{directory}: expected a fitted orbit of format {FORMAT} or older, found "
            f"{head['format']}; it was written by a newer plateviz"
        )
    timings = json.loads((directory / _TIMINGS).read_text(encoding="utf-8"))
    tables = {table.name: _read_table(directory, table.name) for table in RESULT_TABLES}
    trace = pd.read_parquet(directory / "trace.parquet")
    tables["trace"] = trace.assign(seconds=timings["trace"])[TRACE.names]
    return FitResult(
        **tables,  # type: ignore[arg-type]
        summary={**head["summary"], "seconds": timings["seconds"]},
        settings=FitSettings.from_dict(head["settings"]),
        provenance=head["provenance"],
    )


def read_summary(directory: Path) -> dict[str, Any]:
    """Return the summary of a complete fitted orbit, with its `seconds`."""
    head, timings = (
        json.loads((directory / name).read_text(encoding="utf-8")) for name in (_HEAD, _TIMINGS)
    )
    return {**head["summary"], "seconds": timings["seconds"]}


def is_complete(directory: Path) -> bool:
    """Return whether a directory is a complete fitted orbit."""
    return (directory / _COMPLETE).is_file()


def _write_tables(directory: Path, result: FitResult, beside: Mapping[str, pd.DataFrame]) -> None:
    tables = {table.name: getattr(result, table.name) for table in RESULT_TABLES}
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
    }
    for name, content in ((_HEAD, head), (_TIMINGS, timings)):
        (directory / name).write_text(json.dumps(content, indent=1), encoding="utf-8")


def _read_table(directory: Path, name: str) -> pd.DataFrame | None:
    path = directory / f"{name}.parquet"
    return pd.read_parquet(path) if path.is_file() else None


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
