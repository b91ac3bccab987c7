"""Reading of ECSV tables and of plain comma-separated values."""

from pathlib import Path

from astropy.table import Table
from pyarrow import csv

from solver.io.arrow import from_arrow
from solver.io.failures import reading
from solver.io.limits import check_size

# The Gaia archive writes null for missing values, where ECSV has an empty field.
_NO_VALUE = [("", "0"), ("null", "0")]


def read_csv(path: Path) -> dict[str, Table]:
    """Read plain comma-separated values, or ECSV if the comments at the top say so."""
    with path.open("rb") as stream:
        comments = 0
        while (line := stream.readline()).startswith(b"#"):
            comments += 1
            if line.startswith(b"# %ECSV"):
                return read_ecsv(path)
    with reading(str(path), "comma-separated values under one line of column names"):
        content = csv.read_csv(path, read_options=csv.ReadOptions(skip_rows=comments))
    check_size(path, content.num_rows, content.num_columns)
    return {path.stem: from_arrow(path, content)}


def read_ecsv(path: Path) -> dict[str, Table]:
    """Read a table in ECSV, with its units and types."""
    with reading(str(path), "an ECSV table"):
        return {path.stem: Table.read(path, format="ascii.ecsv", fill_values=_NO_VALUE)}
