"""The rows that *Explore* draws, as a table to be saved."""

from astropy.table import Table

from plateviz.dashboard.saving.downloads import rows_of
from plateviz.plots.explore.explored_rows import ExploredColumns, kept_rows, rows_in_frame
from plateviz.tables.explore import ExplorableTable
from solver.errors import InputError

# Columns that say what a saved row is of, besides the id of its source.
_KEYS = ("orbit_id", "field_id", "plate_id", "detector_id")
_MOST_SAVED = 1_000_000


def explored_file(table: ExplorableTable, chosen: ExploredColumns) -> dict[str, Table]:
    """Return the rows between the limits, with the columns that are drawn and those of keys.

    Raises
    ------
    InputError
        If they are too many.
    """
    keys = [name for name in _KEYS if name in table.columns]
    if table.size <= _MOST_SAVED:
        rows = kept_rows(table, chosen)
    else:
        # Each column that nobody has asked for is to be read.
        keys = keys[:1]
        rows = rows_in_frame(table, chosen, chosen.limits)
        if len(rows) > _MOST_SAVED:
            raise InputError(
                f"{len(rows):,} rows are too many to save, at most {_MOST_SAVED:,}: "
                "zoom in, limit the rows, or read the Parquet files of the run"
            )
    drawn = filter(None, (chosen.x, chosen.y, chosen.colour, chosen.only))
    return {table.rows: rows_of(table, rows, dict.fromkeys((*keys, *drawn)))}
