"""Stars of the Gaia archive: the columns that the simulator takes, checked and converted."""

from dataclasses import replace

import numpy as np
import pandas as pd
from astropy.table import Table as RawTable

from solver.data.columns import Table
from solver.data.schema import CATALOGUE
from solver.errors import InputError
from solver.io.column_check import missing_rows
from solver.io.table_check import conform, matched_names

_FLAGS = ("is_reference", "is_artificial")

# The archive says nothing of flags, but always how sure a parallax is.
GAIA = Table(
    "Gaia",
    tuple(
        replace(column, required=True, default=None) if column.name == "parallax_error" else column
        for column in CATALOGUE
        if column.name not in _FLAGS
    ),
    key=("source_id",),
)


def gaia_stars(table: RawTable | pd.DataFrame, where: str) -> pd.DataFrame:
    """Return the stars of a table of the Gaia archive that have all five parameters.

    Columns are found without regard to case and converted to the units of the archive,
    which are also assumed where a column has none. Rows that lack a value in any of the
    columns are left out, as the archive's sources without a parallax do.

    Parameters
    ----------
    table : columns named as in the archive; the ten correlations may be absent
    where : what messages call the table

    Returns
    -------
    `GAIA`, in the order of the table; a correlation that the table lacks is zero

    Raises
    ------
    InputError
        If a column is missing or cannot be used, or no row is complete.
    """
    raw = RawTable.from_pandas(table) if isinstance(table, pd.DataFrame) else table
    used = list(matched_names(raw.colnames, GAIA).values())
    lacking = np.zeros(len(raw), dtype=bool)
    for name in used:
        lacking |= missing_rows(raw[name])
    if len(raw) and lacking.all():
        raise InputError(
            f"{where}: expected a row with a value in each of {', '.join(used)}, "
            f"found none among {len(raw)} rows"
        )
    if lacking.any():
        where = f"{where}, its {int((~lacking).sum())} rows without gaps"
    return conform(raw[~lacking], GAIA, where)
