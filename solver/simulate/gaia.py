"""Stars of the Gaia archive: check and convert the columns that the simulator uses."""

from dataclasses import replace

import numpy as np
import pandas as pd
from astropy.table import Table as RawTable

from solver.data.columns import Column, Table
from solver.data.plural import plural
from solver.data.schema import CATALOGUE
from solver.errors import InputError
from solver.io.column_check import missing_rows
from solver.io.table_check import conform, matched_names

_MAGNITUDE = "phot_g_mean_mag"
# The archive has no flags, and its magnitude is used only where it is asked for.
_UNUSED = ("is_reference", "is_artificial", "magnitude")

# The archive always has an uncertainty of the parallax.
GAIA = Table(
    "Gaia",
    tuple(
        replace(column, required=True, default=None) if column.name == "parallax_error" else column
        for column in CATALOGUE
        if column.name not in _UNUSED
    ),
    key=("source_id",),
)


def gaia_stars(table: RawTable | pd.DataFrame, where: str) -> pd.DataFrame:
    """Return the stars of a table of the Gaia archive that have all five parameters.

    Column names are matched ignoring case. Values are converted to the units of the archive,
    which are assumed for columns without a unit. Rows with a missing value in any of the
    columns are dropped, such as the archive's sources without a parallax.

    Parameters
    ----------
    table : columns named as in the archive; the ten correlations may be absent
    where : name of the table in messages

    Returns
    -------
    `GAIA`, in the order of the table; correlations that the table lacks are zero

    Raises
    ------
    InputError
        If a column is missing or invalid, or no row is complete.
    """
    raw = RawTable.from_pandas(table) if isinstance(table, pd.DataFrame) else table
    used = list(matched_names(raw.colnames, GAIA).values())
    is_incomplete = np.zeros(len(raw), dtype=bool)
    for name in used:
        is_incomplete |= missing_rows(raw[name])
    if len(raw) and is_incomplete.all():
        raise InputError(
            f"{where}: expected a row with a value in each of {', '.join(used)}, "
            f"found none among {len(raw)} {plural(len(raw), 'row')}"
        )
    if is_incomplete.any():
        where = f"{where}, its {int((~is_incomplete).sum())} complete rows"
    return conform(raw[~is_incomplete], GAIA, where)


def gaia_magnitudes(
    table: RawTable | pd.DataFrame, source_ids: pd.Series, where: str
) -> np.ndarray:
    """Return the G magnitudes of sources of a table of the Gaia archive.

    Parameters
    ----------
    source_ids : as from `gaia_stars`
    where : name of the table in messages

    Raises
    ------
    InputError
        If the column is missing, or a source has no magnitude.
    """
    raw = RawTable.from_pandas(table) if isinstance(table, pd.DataFrame) else table
    column = Column(_MAGNITUDE, "float64", "mag", "mean magnitude in G")
    schema = Table("Gaia", (GAIA["source_id"], column))
    names = matched_names(raw.colnames, schema)
    if _MAGNITUDE not in names:
        raise InputError(
            f"{where}: expected a column {_MAGNITUDE}, for the magnitudes that were asked for, "
            f"found {', '.join(raw.colnames)}"
        )
    chosen = np.isin(np.asarray(raw[names["source_id"]]), source_ids)
    return conform(raw[chosen], schema, where)[_MAGNITUDE].to_numpy()
