"""Fitted orbits on disk: one directory each, Parquet inside, whole or not there at all.

No user interface and no JAX. A directory is written beside its place and renamed, with
the file `COMPLETE` written last; it is never edited afterwards.
"""

import json
import os
import shutil
import tempfile
from pathlib import Path

import pandas as pd

from solver.errors import InputError
from solver.result import FitResult
from solver.schema import RESULT_TABLES
from solver.settings import FitSettings

FORMAT = 1
_COMPLETE = "COMPLETE"
_HEAD = "result.json"


def write_run(directory: Path, result: FitResult) -> None:
    """Write one fitted orbit; an existing directory is left as it is.

    Parameters
    ----------
    directory : does not exist yet; its parent is made where needed
    """
    directory.parent.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(prefix=f".{directory.name}-", dir=directory.parent))
    try:
        for table in RESULT_TABLES:
            frame = getattr(result, table.name)
            if frame is not None:
                frame.to_parquet(beside / f"{table.name}.parquet", index=False)
        head = {
            "format": FORMAT,
            "settings": result.settings.to_dict(),
            "summary": dict(result.summary),
            "provenance": dict(result.provenance),
        }
        (beside / _HEAD).write_text(json.dumps(head, indent=1), encoding="utf-8")
        for path in beside.iterdir():
            _flush(path)
        (beside / _COMPLETE).touch()
        _flush(beside)
        if not directory.exists():
            beside.rename(directory)
            _flush(directory.parent)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def read_run(directory: Path) -> FitResult:
    """Read one fitted orbit.

    Raises
    ------
    InputError
        If the directory is not a complete run, or was written by a newer version.
    """
    if not is_complete(directory):
        raise InputError(f"{directory}: expected a complete run, found no {_COMPLETE} file in it")
    head = json.loads((directory / _HEAD).read_text(encoding="utf-8"))
    if head["format"] > FORMAT:
        raise InputError(
            f"{directory}: expected a run of format {FORMAT} or older, found {head['format']}; "
            "it was written by a newer plateviz"
        )
    tables = {table.name: _read_table(directory, table.name) for table in RESULT_TABLES}
    return FitResult(
        **tables,  # type: ignore[arg-type]
        summary=head["summary"],
        settings=FitSettings.from_dict(head["settings"]),
        provenance=head["provenance"],
    )


def is_complete(directory: Path) -> bool:
    """Return whether a directory holds a whole run."""
    return (directory / _COMPLETE).is_file()


def _read_table(directory: Path, name: str) -> pd.DataFrame | None:
    path = directory / f"{name}.parquet"
    return pd.read_parquet(path) if path.is_file() else None


def _flush(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
