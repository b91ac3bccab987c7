"""Results on their way from the solver process to its server: whole or absent, read in place.

No user interface and no JAX. A directory has an uncompressed Arrow file for each table, and
`result.json`. It is written under another name and then renamed. It lasts as long as the server,
and no other program reads it: nothing is flushed to the disk, and nothing has a checksum.
`plateviz.runs.fitted_orbit` writes what is kept.
"""

import json
import shutil
import sys
from pathlib import Path
from tempfile import mkdtemp

import pandas as pd
import pyarrow as pa

from solver.data.result import FitResult
from solver.data.schema import RESULT_TABLES
from solver.io.disk import writing
from solver.io.failures import reading
from solver.io.settings import parse_settings

_HEAD = "result.json"
# Windows removes no file that is read in place.
_IS_IN_PLACE = sys.platform != "win32"


def write_scratch_result(directory: Path, result: FitResult) -> None:
    """Write a result; an existing directory is not changed.

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
            }
            (staging / _HEAD).write_text(json.dumps(head), encoding="utf-8")
            if not directory.exists():
                staging.rename(directory)
        finally:
            shutil.rmtree(staging, ignore_errors=True)


def is_written(directory: Path) -> bool:
    """Return whether a directory has a result, which is whole from the first moment on."""
    return (directory / _HEAD).is_file()


def read_scratch_result(directory: Path) -> FitResult:
    """Read a result; its tables stay in their files, and are loaded where they are used.

    Raises
    ------
    InputError
        If there is none, or it cannot be read.
    """
    with reading(str(directory), "the result of a fit"):
        head = json.loads((directory / _HEAD).read_text(encoding="utf-8"))
        tables = {
            table.name: _read_table(directory / f"{table.name}.arrow") for table in RESULT_TABLES
        }
        return FitResult(
            **tables,  # type: ignore[arg-type]
            summary=head["summary"],
            settings=parse_settings(head["settings"], str(directory / _HEAD)),
            provenance=head["provenance"],
        )


def _write_table(path: Path, frame: pd.DataFrame) -> None:
    content = pa.Table.from_pandas(frame, preserve_index=False)
    with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_file(sink, content.schema) as writer:
        writer.write_table(content)


def _read_table(path: Path) -> pd.DataFrame | None:
    if not path.is_file():
        return None
    with pa.memory_map(str(path)) if _IS_IN_PLACE else pa.OSFile(str(path)) as source:
        # One block for each column: columns would be copied into a common one.
        return pa.ipc.open_file(source).read_all().to_pandas(split_blocks=True)
