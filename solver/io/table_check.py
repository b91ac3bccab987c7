"""Table checks: a raw table against its schema, with everything wrong said at once."""

from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches

import numpy as np
import pandas as pd
from astropy.table import Table as RawTable

from solver.data.columns import Column, Table
from solver.errors import InputError
from solver.io.column_check import convert

_MOST_IN_ONE_MESSAGE = 5


def conform(raw: RawTable, schema: Table, where: str) -> pd.DataFrame:
    """Return a raw table as `schema` asks: its columns, in its order, types and units.

    Columns are found without regard to case, the canonical name first and then the
    aliases in order; other columns are left out, and absent optional ones are filled.

    Parameters
    ----------
    raw : a table as it was in a file
    schema : what it should be
    where : the file and table, for messages

    Raises
    ------
    InputError
        If anything in `problems` is wrong with it.
    """
    frame, found = examine(raw, schema, where)
    refuse(found)
    return frame


def problems(raw: RawTable, schema: Table, where: str) -> list[str]:
    """Return everything that keeps `raw` from being a table of `schema`, one message each."""
    return examine(raw, schema, where)[1]


def refuse(found: list[str]) -> None:
    """Raise one `InputError` that tells the first few of the problems `found`, if any."""
    if not found:
        return
    message = "; ".join(found[:_MOST_IN_ONE_MESSAGE])
    if len(found) > _MOST_IN_ONE_MESSAGE:
        message += f"; and {len(found) - _MOST_IN_ONE_MESSAGE} more"
    raise InputError(message)


def examine(raw: RawTable, schema: Table, where: str) -> tuple[pd.DataFrame, list[str]]:
    """Return the columns of `schema` that `raw` has in a usable state, and every problem."""
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
    """Return canonical name -> name in the file, for the columns of `schema` that are there.

    The canonical name goes before its aliases, and the same case before another.
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
    # Where absence would be filled with NaN, a NaN in the file says no less.
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
    told = ", ".join(_with_close_match(column, spare) for column in missing)
    return [
        f"{where}: expected the columns of a {schema.name} table, found none for {told}; "
        f"the columns there are: {', '.join(present) or 'none'}"
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
    example = frame.loc[repeated.idxmax(), key]
    told = ", ".join(f"{name} {value}" for name, value in example.items())
    return [
        f"{where}: expected each {', '.join(key)} once, found {int(repeated.sum())} rows that "
        f"repeat another, for example {told} in row {int(repeated.idxmax()) + 1}"
    ]
