"""Raw tables of one file in any supported format, with its names, units and values."""

from collections.abc import Callable
from pathlib import Path

from astropy.table import Table

from solver.errors import InputError
from solver.io.ecsv import read_csv, read_ecsv
from solver.io.failures import reading
from solver.io.fits import read_fits
from solver.io.limits import MAX_BYTES
from solver.io.outputs import FITS_SUFFIXES
from solver.io.parquet import read_parquet
from solver.io.votable import read_votable


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
    return path.suffix.lower() in FITS_SUFFIXES


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


_VOTABLE = (".xml", ".vot", ".votable")
_ONE_TABLE = (".ecsv", ".csv", ".parquet")
_READERS: dict[str, Callable[[Path], dict[str, Table]]] = {
    **dict.fromkeys(FITS_SUFFIXES, _read_fits),
    **dict.fromkeys(_VOTABLE, read_votable),
    ".ecsv": read_ecsv,
    ".csv": read_csv,
    ".parquet": read_parquet,
}
