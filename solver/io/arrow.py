"""Convert tables of Apache Arrow, which the readers of CSV and Parquet return, to astropy."""

from pathlib import Path

import numpy as np
import pyarrow as pa
from astropy.table import Column, MaskedColumn, Table
from astropy.units import Unit

from solver.errors import InputError


def from_arrow(path: Path, content: pa.Table) -> Table:
    """Return a table with stripped names, the units of the fields, and masked missing values.

    Raises
    ------
    InputError
        If a name occurs twice; the message names the file at `path`.
    """
    names = [name.strip() for name in content.column_names]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise InputError(
            f"{path}: expected each column name once, found repeated: {', '.join(repeated)}"
        )
    table = Table()
    for name, field, values in zip(names, content.schema, content.columns, strict=True):
        table[name] = _column(values)
        unit = (field.metadata or {}).get(b"unit")
        if unit:
            table[name].unit = Unit(unit.decode(), parse_strict="silent")
    return table


def _column(values: pa.ChunkedArray) -> Column:
    if pa.types.is_dictionary(values.type):
        values = values.cast(values.type.value_type)
    missing = values.is_null().to_numpy()
    # Nulls are filled before conversion to NumPy: integers with nulls would become floats.
    if pa.types.is_integer(values.type) or pa.types.is_floating(values.type):
        array = values.fill_null(0).to_numpy()
    elif pa.types.is_boolean(values.type):
        array = values.fill_null(False).to_numpy()
    elif pa.types.is_null(values.type):
        array = np.zeros(len(values))
    else:
        array = values.to_numpy()
    return MaskedColumn(array, mask=missing) if missing.any() else Column(array)
