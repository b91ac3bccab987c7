"""Table checks: convert a raw table to its schema and report all problems at once."""

from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches

import numpy as np
import pandas as pd
from astropy.table import Table as RawTable

from solver.data.columns import Column, Table
from solver.data.plural import plural
from solver.errors import InputError
from solver.io.column_check import convert

_MAX_LISTED_PROBLEMS = 5


def conform(raw: RawTable, schema: Table, where: str) -> pd.DataFrame:
    """Convert a raw table to the columns, order, types and units of `schema`.

    Column names are matched ignoring case, the canonical name first and then the aliases in
    order. Other columns are dropped; absent optional columns get their default.

    Parameters
    ----------
    raw : a table as read from a file
    schema : definition of the expected table
    where : the file and table, for messages

    Raises
    ------
    InputError
        If the table does not conform to `schema`.
    """
    frame, found = examine(raw, schema, where)
    refuse(found)
    return frame


def refuse(found: list[str]) -> None:
    """Raise one `InputError` that lists the first few of the problems `found`, if any."""
    if not found:
        return
    message = "; ".join(found[:_MAX_LISTED_PROBLEMS])
    if len(found) > _MAX_LISTED_PROBLEMS:
        message += f"; and {len(found) - _MAX_LISTED_PROBLEMS} more"
    raise InputError(message)


def examine(raw: RawTable, schema: Table, where: str) -> tuple[pd.DataFrame, list[str]]:
    """Return the usable columns of `schema` in `raw`, and all problems."""
    names = matched_names(raw.colnames, schema)
    found = _missing(raw.colnames, names, schema, where)
    if len(raw) == 0:
        found.append(f"{where}: expected at least one row, found none")
        return pd.DataFrame(), found
    columns: dict[str, np.ndarray] = {}
    for column in schema:
        if column.name in names:
            name = names[column.name]
            converted = convert(raw[name], _relaxed(column), f"{where}, column {name!r}")
            found += converted.problems
            if converted.values is not None:
                columns[column.name] = converted.values
        elif not column.required:
            columns[column.name] = _absent(column, len(raw))
    frame = pd.DataFrame(columns)
    return frame, found + _repeated(frame, schema, where)


def matched_names(present: list[str], schema: Table) -> dict[str, str]:
    """Return canonical name -> name in the file, for the columns of `schema` that are present.

    The canonical name has priority over aliases, and a match of case over one without.
    """
    names = {name.strip().lower(): name for name in reversed(present)}
    names.update({name: name for name in present})
    matched = {}
    for column in schema:
        accepted = (column.name, *column.aliases)
        spellings = (spelling for name in accepted for spelling in (name, name.lower()))
        found = next((names[spelling] for spelling in spellings if spelling in names), None)
        if found is not None:
            matched[column.name] = found
    return matched


def _relaxed(column: Column) -> Column:
    # If an absent column would be filled with NaN, NaN in the file is valid too.
    nan_if_absent = not column.required and column.dtype == "float64" and column.default is None
    return replace(column, may_be_nan=column.may_be_nan or nan_if_absent)


def _absent(column: Column, rows: int) -> np.ndarray:
    blank = {"float64": np.nan, "bool": False, "str": ""}.get(column.dtype, 0)
    value = blank if column.default is None else column.default
    return np.full(rows, value, dtype=object if column.dtype == "str" else column.dtype)


def _missing(present: list[str], names: Mapping[str, str], schema: Table, where: str) -> list[str]:
    missing = [c for c in schema if c.required and c.name not in names]
    if not missing:
        return []
    spare = [name for name in present if name not in names.values()]
    listed = ", ".join(_with_close_match(column, spare) for column in missing)
    return [
        f"{where}: expected the columns of a {schema.name} table, found none for {listed}; "
        f"the columns found are: {', '.join(present) or 'none'}"
    ]


def _with_close_match(column: Column, spare: list[str]) -> str:
    folded = {name.lower(): name for name in spare}
    for accepted in (column.name, *column.aliases):
        close = get_close_matches(accepted, folded, n=1)
        if close:
            return f"{column.name} (did you mean {folded[close[0]]!r}?)"
    return column.name


def _repeated(frame: pd.DataFrame, schema: Table, where: str) -> list[str]:
    key = list(schema.key)
    if not key or not set(key) <= set(frame.columns):
        return []
    repeated = frame.duplicated(key)
    if not repeated.any():
        return []
    count = int(repeated.sum())
    example = frame.loc[repeated.idxmax(), key]
    key_text = ", ".join(f"{name} {value}" for name, value in example.items())
    return [
        f"{where}: expected each {', '.join(key)} once, found {count} "
        f"{plural(count, 'row')} that {'repeats' if count == 1 else 'repeat'} another, for example "
        f"{key_text} in row {int(repeated.idxmax()) + 1}"
    ]
