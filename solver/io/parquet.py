"""Parquet files: small, fast to write and to read, and with a checksum of each page."""

from pathlib import Path

import pandas as pd
import pyarrow as pa
from astropy.table import Table
from pyarrow import parquet
from pyarrow.compute import Expression

from solver.errors import InputError
from solver.io.arrow import from_arrow
from solver.io.failures import reading, refusing
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
        write_page_checksum=True,
    )


def count_rows(path: str) -> int:
    """Return the number of rows of a table; InputError if it cannot be read."""
    # A pipe would be waited for.
    if Path(path).exists() and not Path(path).is_file():
        raise InputError(f"{path}: expected a table of plateviz, found something that is no file")
    with refusing(path, "a table of plateviz"):
        return int(parquet.read_metadata(path).num_rows)


def write_batches(batches: pa.RecordBatchReader, path: Path) -> None:
    """Write batches of rows, each as a row group, which can be read without the others."""
    with parquet.ParquetWriter(
        path, batches.schema, compression="zstd", write_page_checksum=True
    ) as writer:
        for batch in batches:
            writer.write_batch(batch, row_group_size=len(batch))


def read_frame(
    path: Path, columns: list[str] | None = None, rows: Expression | None = None
) -> pd.DataFrame:
    """Read a table that this project wrote, and verify the checksums of the pages that are read.

    Parameters
    ----------
    columns : names of columns to read; all by default
    rows : condition of the rows to read; pages of others are skipped as far as possible

    Raises
    ------
    InputError
        If the file is damaged, or lacks a column.
    """
    with reading(str(path), "a table of plateviz"):
        content = parquet.read_table(
            str(path),
            columns=columns,
            filters=rows,
            # Otherwise a folder called orbit=0000 becomes a column.
            partitioning=None,
            page_checksum_verification=True,
        )
        return content.to_pandas()


def read_columns(path: Path, columns: list[str]) -> pa.Table:
    """Read some columns of a table as `read_frame` does, for use by several threads at once.

    Raises
    ------
    InputError
        If the file is damaged, or lacks a column.
    """
    with (
        refusing(str(path), "a table of plateviz"),
        parquet.ParquetFile(path, page_checksum_verification=True) as file,
    ):
        names = file.schema_arrow.names
        # The checksums of pages do not protect the names: one bit makes "residual_y" of "_x".
        if len(set(names)) < len(names) or not set(columns) <= set(names):
            raise InputError(
                f"{path}: expected the columns {', '.join(columns)} once each, found other names"
            )
        return file.read(columns, use_threads=False)


def read_parquet(path: Path) -> dict[str, Table]:
    """Read a table, with the units that its columns or astropy's header have."""
    with reading(str(path), "a Parquet table"):
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            check_size(path, file.metadata.num_rows, file.metadata.num_columns)
            content = file.read()
            if b"table_meta_yaml" not in (file.schema_arrow.metadata or {}):
                return {path.stem: from_arrow(path, content)}
        return {path.stem: Table.read(path, format="parquet")}
