"""Parquet files: written so that they are small, and quick to write and to read."""

from pathlib import Path

import pyarrow as pa
from pyarrow import parquet


def write_parquet(table: pa.Table, path: Path) -> None:
    """Write a table, with numbers by their bytes and all else by a dictionary.

    What is measured hardly repeats, so that a dictionary of it, which Parquet tries by default,
    is thrown away after half of the time; sign and exponent are alike, and apart from the rest
    they are compressed to little.
    """
    numbers = [field.name for field in table.schema if pa.types.is_floating(field.type)]
    parquet.write_table(
        table,
        path,
        compression="zstd",
        use_dictionary=[name for name in table.column_names if name not in numbers],
        use_byte_stream_split=numbers,
    )
