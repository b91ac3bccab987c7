"""Results on their way from the solver process to its server: whole or absent, read in place.

No user interface and no JAX. A directory has an uncompressed Arrow file for each table, and
`result.json`. It is written under another name and then renamed. It lasts as long as the server,
and no other program reads it: nothing is flushed to the disk, and nothing has a checksum.
`plateviz.runs.fitted_orbit` writes what is kept.

The eigenmodes may follow later. Who uses them waits for them.
"""

import json
import shutil
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import mkdtemp
from typing import NamedTuple

import pandas as pd
import pyarrow as pa

from solver.data.eigenmode_schema import EIGENMODE_TABLES
from solver.data.result import FitResult
from solver.data.schema import RESULT_TABLES
from solver.errors import InputError
from solver.io.disk import writing
from solver.io.failures import reading
from solver.io.settings import parse_settings

_HEAD = "result.json"
_LATER = tuple(table.name for table in EIGENMODE_TABLES)
# Windows removes no file that is read in place.
_IS_IN_PLACE = sys.platform != "win32"
_PATIENCE_SECONDS, _LOOK_SECONDS = 10.0, 0.005


def write_scratch_result(directory: Path, result: FitResult, *, is_partial: bool = False) -> None:
    """Write a result; an existing directory is not changed.

    Parameters
    ----------
    is_partial : whether `write_eigenmodes` follows

    Raises
    ------
    DiskError
        If the disk is full or takes no file for another reason.
    InputError
        If writing fails otherwise.
    """
    with writing(directory, "to write the result of a fit"):
        staging = Path(mkdtemp(prefix=f".{directory.name}-", dir=directory.parent))
        try:
            for table in RESULT_TABLES:
                frame = getattr(result, table.name)
                if frame is not None:
                    _write_table(staging / f"{table.name}.arrow", frame)
            head = {
                "settings": result.settings.to_dict(),
                "summary": dict(result.summary),
                "provenance": dict(result.provenance),
                "is_partial": is_partial,
            }
            (staging / _HEAD).write_text(json.dumps(head), encoding="utf-8")
            if not directory.exists():
                staging.rename(directory)
        finally:
            shutil.rmtree(staging, ignore_errors=True)


def write_eigenmodes(directory: Path, tables: Mapping[str, pd.DataFrame]) -> None:
    """Add the eigenmodes to a result that was written without; errors as above."""
    with writing(directory, "to write the eigenmodes of a fit"):
        for name, frame in tables.items():
            _write_table(directory / f"{name}.part", frame)
            (directory / f"{name}.part").rename(directory / f"{name}.arrow")


def is_written(directory: Path) -> bool:
    """Return whether a directory has a result, which is whole from the first moment on."""
    return (directory / _HEAD).is_file()


def read_scratch_result(
    directory: Path, hurry: Callable[[], bool] = lambda: True
) -> "ScratchResult":
    """Read a result; its tables stay in their files, and are loaded where they are used.

    Parameters
    ----------
    hurry : called when eigenmodes are used that have not been written yet; whether they will be

    Raises
    ------
    InputError
        If there is none, or it cannot be read.
    """
    with reading(str(directory), "the result of a fit"):
        head = json.loads((directory / _HEAD).read_text(encoding="utf-8"))
        later = _LATER if head["is_partial"] else ()
        tables: dict[str, pd.DataFrame | _Awaited | None] = {
            table.name: _Awaited(directory / f"{table.name}.arrow", hurry)
            if table.name in later
            else _read_table(directory / f"{table.name}.arrow")
            for table in RESULT_TABLES
        }
        return ScratchResult(
            **tables,  # type: ignore[arg-type]
            summary=head["summary"],
            settings=parse_settings(head["settings"], str(directory / _HEAD)),
            provenance=head["provenance"],
        )


class _Awaited(NamedTuple):
    """A table whose file may not be there yet."""

    path: Path
    hurry: Callable[[], bool]

    def read(self) -> pd.DataFrame | None:
        is_to_come = self.path.is_file() or self.hurry()
        end = time.monotonic() + _PATIENCE_SECONDS
        while not self.path.is_file():
            if not is_to_come or time.monotonic() > end:
                raise InputError(
                    f"{self.path}: expected the eigenmodes of the solution, found that the solver "
                    "ended before it wrote them; fit again"
                )
            time.sleep(_LOOK_SECONDS)
        return _read_table(self.path)


class _Later:
    """A field that reads its table when it is first used."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, result: FitResult | None, owner: type) -> pd.DataFrame | None:
        if result is None:
            return None
        value = result.__dict__[self._name]
        if isinstance(value, _Awaited):
            value = result.__dict__[self._name] = value.read()
        return value

    def __set__(self, result: FitResult, value: object) -> None:
        result.__dict__[self._name] = value


class ScratchResult(FitResult):
    """A result of a scratch directory: a `FitResult` whose eigenmodes may be written later."""

    modes = _Later()  # type: ignore[assignment]
    mode_parameters = _Later()  # type: ignore[assignment]
    mode_shifts = _Later()  # type: ignore[assignment]


def _write_table(path: Path, frame: pd.DataFrame) -> None:
    content = pa.table({name: _arrow(frame[name]) for name in frame})
    with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_file(sink, content.schema) as writer:
        writer.write_table(content)


def _arrow(column: pd.Series) -> pa.Array:
    """Return a column; numbers are neither copied nor searched for NaN, which stays NaN."""
    return pa.array(column.to_numpy() if column.dtype.kind in "biuf" else column)


def _read_table(path: Path) -> pd.DataFrame | None:
    if not path.is_file():
        return None
    with pa.memory_map(str(path)) if _IS_IN_PLACE else pa.OSFile(str(path)) as source:
        # One block for each column: columns would be copied into a common one.
        return pa.ipc.open_file(source).read_all().to_pandas(split_blocks=True)
