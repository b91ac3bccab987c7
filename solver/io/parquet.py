"""Parquet files: small, and fast to write and to read."""

from pathlib import Path

import pyarrow as pa
from astropy.table import Table
from pyarrow import parquet

from solver.io.arrow import from_arrow
from solver.io.failures import reading
from solver.io.limits import check_size


def write_parquet(table: pa.Table, path: Path) -> None:
    """Write a table, with byte-stream split for floats and a dictionary for other columns.

    Measured values hardly repeat, so a dictionary, which Parquet tries by default, would take
    half of the time and be discarded. Their sign and exponent bytes are similar, and compress
    well when stored apart from the other bytes.
    """
    floats = [field.name for field in table.schema if pa.types.is_floating(field.type)]
    parquet.write_table(
        table,
        path,
        compression="zstd",
        use_dictionary=[name for name in table.column_names if name not in floats],
        use_byte_stream_split=floats,
    )


def read_parquet(path: Path) -> dict[str, Table]:
    """Read a table, with the units that its columns or astropy's header have."""
    with reading(str(path), "a Parquet table"):
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            check_size(path, file.metadata.num_rows, file.metadata.num_columns)
            if b"table_meta_yaml" not in (file.schema_arrow.metadata or {}):
                return {path.stem: from_arrow(path, file.read())}
        return {path.stem: Table.read(path, format="parquet")}
