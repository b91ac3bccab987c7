"""Parquet files: small, and fast to write and to read."""

from pathlib import Path

import pyarrow as pa
from pyarrow import parquet


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
