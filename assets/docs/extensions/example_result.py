"""A result of one source on one exposure, from which the pages on file formats are generated."""

from functools import cache

import pandas as pd

from solver.data import schema
from solver.data.columns import Column, Table
from solver.data.parameters import CALIBRATION_GROUPS
from solver.data.result import FitResult
from solver.data.settings import FitSettings

_VALUES = {"int64": 0, "float64": 1.0, "bool": True, "str": ""}


@cache
def example_result() -> FitResult:
    """Return a result with one row in each table, and one of each parameter group."""
    tables = {table.name: _one_row(table) for table in schema.RESULT_TABLES}
    rows = [tables["calibration"].assign(group=group.name) for group in CALIBRATION_GROUPS]
    tables["calibration"] = pd.concat(rows, ignore_index=True)
    inputs = {"OBS.fits": "SHA-256 of the file", "REF.fits": "SHA-256 of the file"}
    return FitResult(**tables, summary={}, settings=FitSettings(), provenance=inputs)


def _one_row(table: Table) -> pd.DataFrame:
    return pd.DataFrame({column.name: [_value(column)] for column in table})


def _value(column: Column) -> object:
    return 61_000.0 if column.unit == "d" else _VALUES[column.dtype]
