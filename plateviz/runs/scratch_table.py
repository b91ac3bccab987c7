"""Tables of a scratch directory: Arrow files that are read in place, by this machine only."""

import sys
from pathlib import Path

import pandas as pd
import pyarrow as pa

# Windows removes no file that is read in place.
_IS_IN_PLACE = sys.platform != "win32"


def write_scratch_table(path: Path, frame: pd.DataFrame) -> None:
    """Write a table as an uncompressed Arrow file."""
    content = pa.table({name: _arrow(frame[name]) for name in frame})
    with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_file(sink, content.schema) as writer:
        writer.write_table(content)


def read_scratch_table(path: Path) -> pd.DataFrame | None:
    """Return a table whose numbers stay in their file; None if there is no file."""
    if not path.is_file():
        return None
    with pa.memory_map(str(path)) if _IS_IN_PLACE else pa.OSFile(str(path)) as source:
        # One block for each column: columns would be copied into a common one.
        return pa.ipc.open_file(source).read_all().to_pandas(split_blocks=True)


def _arrow(column: pd.Series) -> pa.Array:
    """Return a column; numbers are neither copied nor searched for NaN, which stays NaN."""
    return pa.array(column.to_numpy() if column.dtype.kind in "biuf" else column)
