"""What a person takes out of the dashboard: tables as files of every format that can be read."""

import io
import re
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd
from astropy.table import Column, Table

from plateviz.solving.turns import Turns
from plateviz.tables.explore import ExplorableTable
from solver.data import columns
from solver.errors import InputError
from solver.io.write_tables import OF_ONE_TABLE, write_tables

FORMATS: Mapping[str, str] = MappingProxyType(
    {"CSV": ".csv", "ECSV": ".ecsv", "VOTable": ".vot", "FITS": ".fits", "Parquet": ".parquet"}
)
"""Name of a format -> suffix of its files."""


class Download(NamedTuple):
    """A file for the browser: its name and its contents."""

    name: str
    content: bytes


Progress = Callable[[int, int], None]
"""Function that takes the number of parts that are done, and of all parts."""


class Done(NamedTuple):
    """What was done instead of making a file, as text."""

    text: str


class Later(NamedTuple):
    """A file that takes seconds to make, or something else that does; it is done on a thread.

    Attributes
    ----------
    make : does it
    turns : of all pages of the server, if one is done at a time
    """

    make: Callable[[Progress], Download | Done]
    turns: Turns | None = None

    def turn(self, wait: Callable[[int], object]) -> AbstractContextManager[None]:
        """Return the context to make it in; `wait` is called as by `Turns.turn`."""
        return nullcontext() if self.turns is None else self.turns.turn(wait)


def as_file(tables: Mapping[str, Table], stem: str, suffix: str) -> Download:
    """Return tables as one file.

    Several tables are put into a ZIP archive if the format holds only one.

    Parameters
    ----------
    tables : name -> table
    stem : name of the file without its suffix; what a file's name may not contain is replaced
    suffix : one of the values of `FORMATS`

    Raises
    ------
    InputError
        If there is no table, or none has a row.
    """
    if not any(len(table) for table in tables.values()):
        raise InputError("there is nothing to save: no row is shown")
    with tempfile.TemporaryDirectory() as folder:
        if suffix in OF_ONE_TABLE and len(tables) > 1:
            # Files of different formats must not replace each other.
            return Download(file_name(stem, f"{suffix}.zip"), _zipped(tables, Path(folder), suffix))
        path = Path(folder) / f"table{suffix}"
        write_tables(_in_ascii(tables) if suffix == ".fits" else tables, path)
        return Download(file_name(stem, suffix), path.read_bytes())


def file_name(stem: str, suffix: str) -> str:
    """Return a name for a file, with dashes for what may have a meaning in a name."""
    return re.sub(r"[^\w.-]+", "-", stem).lstrip(".-") + suffix


def rows_of(table: ExplorableTable, rows: np.ndarray, names: Iterable[str] | None = None) -> Table:
    """Return rows, with the units and meanings of their columns.

    Parameters
    ----------
    rows : their numbers, or whether each row is one of them
    names : columns besides the id and the class of a source; all by default
    """
    found = Table()
    if table.has_sources:
        sources = table.sources()
        codes = sources.codes[rows]
        found["source_id"] = sources.ids[codes]
        if sources.classes is not None:
            found["source_class"] = _plain(sources.classes[codes])
    for name in table.columns if names is None else names:
        column = table.columns[name]
        found[name] = _described(_whole(table.read(name)[rows], column), column)
    return found


def _whole(values: np.ndarray, column: columns.Column) -> np.ndarray:
    """Return what is whole by its definition, such as an id, as such: a run reads it as float32."""
    is_whole = column.dtype == "int64" and values.dtype.kind == "f" and np.isfinite(values).all()
    return values.astype(np.int64) if is_whole else values


def described(frame: pd.DataFrame, definition: columns.Table) -> Table:
    """Return the columns of a definition that a frame has, with their units and meanings."""
    return Table(
        {
            one.name: _described(frame[one.name].to_numpy(), one)
            for one in definition
            if one.name in frame
        }
    )


def _described(values: np.ndarray, column: columns.Column) -> Column:
    return Column(_plain(values), unit=column.unit or None, description=column.meaning)


def _plain(values: np.ndarray) -> np.ndarray:
    return values.astype(str) if values.dtype == object else values


def _zipped(tables: Mapping[str, Table], folder: Path, suffix: str) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, table in tables.items():
            path = folder / f"{name}{suffix}"
            write_tables({name: table}, path)
            archive.write(path, path.name)
    return packed.getvalue()


def _in_ascii(tables: Mapping[str, Table]) -> dict[str, Table]:
    """Return the tables with other characters than ASCII, which FITS lacks, as escapes."""
    return {name: _escaped(table) for name, table in tables.items()}


def _escaped(table: Table) -> Table:
    made = table.copy()
    for name in made.colnames:
        column = made[name]
        if column.dtype.kind == "U":
            made[name] = np.char.encode(np.asarray(column), "ascii", "backslashreplace")
        if column.description:
            made[name].description = _ascii(column.description)
    made.meta = {key: _ascii(str(value)) for key, value in made.meta.items()}
    return made


def _ascii(text: str) -> str:
    return text.encode("ascii", "backslashreplace").decode()
