import os

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from pyarrow import parquet

from solver.errors import InputError
from solver.io.parquet import count_rows, write_parquet


@pytest.fixture
def table():
    random = np.random.default_rng(1)
    return pd.DataFrame(
        {
            "source_id": np.repeat(np.arange(2000) + 2**53 + 1, 5),
            "residual": np.append(random.normal(size=9_998), [np.nan, -0.0]),
            "label": pd.Series(["α", ""] * 5_000, dtype="str"),
            "is_reference": random.random(10_000) < 0.5,
        }
    )


def test_table_round_trips_bit_for_bit(table, tmp_path):
    write_parquet(pa.Table.from_pandas(table, preserve_index=False), tmp_path / "t.parquet")
    back = pd.read_parquet(tmp_path / "t.parquet")
    pd.testing.assert_frame_equal(back, table)
    assert np.array_equal(np.signbit(back["residual"]), np.signbit(table["residual"]))


def test_floats_use_byte_stream_split_and_the_rest_a_dictionary(table, tmp_path):
    write_parquet(pa.Table.from_pandas(table, preserve_index=False), tmp_path / "t.parquet")
    group = parquet.ParquetFile(tmp_path / "t.parquet").metadata.row_group(0)
    encodings = {group.column(i).path_in_schema: group.column(i).encodings for i in range(4)}
    assert "BYTE_STREAM_SPLIT" in encodings["residual"]
    assert "RLE_DICTIONARY" in encodings["source_id"]


def test_table_without_columns_or_rows_is_written(tmp_path):
    write_parquet(pa.table({"x": pa.array([], pa.float64())}), tmp_path / "t.parquet")
    assert pd.read_parquet(tmp_path / "t.parquet").empty


def test_pipe_is_no_table(tmp_path):
    os.mkfifo(tmp_path / "pipe.parquet")
    with pytest.raises(InputError, match="expected a table of plateviz, found something that is"):
        count_rows(str(tmp_path / "pipe.parquet"))
