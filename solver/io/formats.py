"""Raw tables of one file in any supported format, with its names, units and values."""

import re
from collections.abc import Callable
from pathlib import Path
from xml.parsers import expat

import numpy as np
import pyarrow as pa
from astropy.io import votable
from astropy.table import Column, MaskedColumn, Table
from astropy.units import Unit
from pyarrow import csv, parquet

from solver.errors import InputError
from solver.io.failures import reading
from solver.io.fits import read_fits
from solver.io.fits_extent import MAX_BYTES, MAX_ROWS

_BYTES_PER_CELL = 8
# The Gaia archive writes null for missing values, where ECSV has an empty field.
_NO_VALUE = [("", "0"), ("null", "0")]


def read_tables(path: Path) -> dict[str, Table]:
    """Read every table of one file.

    Parameters
    ----------
    path : a FITS, ECSV, CSV, Parquet or VOTable file, recognised by its suffix

    Returns
    -------
    Name -> table. Tables in FITS and VOTable files have names; a file of any other format has
    one table, named like the file without the suffix. Missing values are masked.

    Raises
    ------
    InputError
        If there is no such file, or it is not a complete and valid file of that format.
    """
    path = Path(path)
    read = _READERS.get(path.suffix.lower())
    if not path.is_file():
        raise InputError(f"{path}: expected a file, found none")
    if read is None:
        raise InputError(
            f"{path}: expected a suffix out of {', '.join(_READERS)}, found {path.suffix!r}"
        )
    if path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: expected at most {MAX_BYTES} bytes, found {path.stat().st_size}")
    with reading(str(path), "a readable file"):
        return read(path)


def holds_one_table(path: Path) -> bool:
    """Return whether files with this suffix contain exactly one table, without a name."""
    return path.suffix.lower() in _ONE_TABLE


def is_fits(path: Path) -> bool:
    """Return whether the suffix is that of a FITS file."""
    return path.suffix.lower() in _FITS


def has_reader(path: Path) -> bool:
    """Return whether files with this suffix can be read."""
    return path.suffix.lower() in _READERS


def place(path: Path, name: str) -> str:
    """Return the location of table `name` in file `path`, as text for messages."""
    if holds_one_table(path):
        return str(path)
    return f"{path}, {'table' if path.suffix.lower() in _VOTABLE else 'HDU'} {name}"


def _read_fits(path: Path) -> dict[str, Table]:
    return read_fits(path).tables


def _read_csv(path: Path) -> dict[str, Table]:
    with path.open("rb") as stream:
        comments = 0
        while (line := stream.readline()).startswith(b"#"):
            comments += 1
            if line.startswith(b"# %ECSV"):
                return _read_ecsv(path)
    with reading(str(path), "comma-separated values under one line of column names"):
        content = csv.read_csv(path, read_options=csv.ReadOptions(skip_rows=comments))
    _check_size(path, content.num_rows, content.num_columns)
    return {path.stem: _from_arrow(path, content)}


def _read_ecsv(path: Path) -> dict[str, Table]:
    with reading(str(path), "an ECSV table"):
        return {path.stem: Table.read(path, format="ascii.ecsv", fill_values=_NO_VALUE)}


def _read_parquet(path: Path) -> dict[str, Table]:
    with reading(str(path), "a Parquet table"):
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            _check_size(path, file.metadata.num_rows, file.metadata.num_columns)
            if b"table_meta_yaml" not in (file.schema_arrow.metadata or {}):
                return {path.stem: _from_arrow(path, file.read())}
        return {path.stem: Table.read(path, format="parquet")}


def _read_votable(path: Path) -> dict[str, Table]:
    with reading(str(path), "a VOTable"):
        _check_markup(path)
        document = votable.parse(path, verify="ignore")
        tables: dict[str, Table] = {}
        for index, element in enumerate(document.iter_tables()):
            name = element.name or element.ID or f"table{index}"
            if name in tables:
                raise InputError(f"{path}: expected each table name once, found {name} again")
            tables[name] = element.to_table(use_names_over_ids=True)
        return tables


def _check_size(path: Path, rows: int, columns: int) -> None:
    size = rows * columns * _BYTES_PER_CELL
    if rows > MAX_ROWS or size > MAX_BYTES:
        raise InputError(
            f"{path}: expected at most {MAX_ROWS} rows and {MAX_BYTES} bytes, "
            f"found {rows} rows of {columns} columns"
        )


def _check_markup(path: Path) -> None:
    # Entities can expand without limit, and an external stream would be downloaded.
    def refuse_entity(*_: object) -> None:
        raise InputError(f"{path}: expected a VOTable without entity declarations, found one")

    def refuse_stream(tag: str, attributes: dict[str, str]) -> None:
        external = "href" in attributes or "gzip" in attributes.get("encoding", "")
        if re.fullmatch(r"(.*:)?STREAM", tag) and external:
            raise InputError(
                f"{path}: expected plain data inside the VOTable, "
                "found a STREAM that is compressed or points elsewhere"
            )

    parser = expat.ParserCreate()
    parser.EntityDeclHandler = refuse_entity
    parser.StartElementHandler = refuse_stream
    with path.open("rb") as stream:
        parser.ParseFile(stream)


def _from_arrow(path: Path, content: pa.Table) -> Table:
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


_FITS = (".fits", ".fit", ".fts")
_VOTABLE = (".xml", ".vot", ".votable")
_ONE_TABLE = (".ecsv", ".csv", ".parquet")
_READERS: dict[str, Callable[[Path], dict[str, Table]]] = {
    **dict.fromkeys(_FITS, _read_fits),
    **dict.fromkeys(_VOTABLE, _read_votable),
    ".ecsv": _read_ecsv,
    ".csv": _read_csv,
    ".parquet": _read_parquet,
}
