"""Writing of tables in formats that `read_tables` reads."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from astropy.io import fits, votable
from astropy.io.votable import tree
from astropy.table import Table

_FITS, _VOTABLE = ".fits", ".vot"
# Suffix of a format that holds one table in a file -> name of the format in astropy.
_OF_ONE_TABLE: Mapping[str, str] = MappingProxyType(
    {".csv": "ascii.csv", ".ecsv": "ascii.ecsv", ".parquet": "parquet"}
)

OF_ONE_TABLE = tuple(_OF_ONE_TABLE)
"""Suffixes of the formats that hold one table in a file."""
SUFFIXES = (_FITS, _VOTABLE, *OF_ONE_TABLE)
"""Suffixes of all formats; all but CSV keep units, descriptions and `meta`; FITS has
descriptions in TCOMMn."""


def write_tables(tables: Mapping[str, Table], path: Path) -> None:
    """Write tables to a file in the format of its suffix, one of `SUFFIXES`.

    An existing file is replaced. The file is not written atomically: `write_atomically` does that.

    Parameters
    ----------
    tables : name -> table; one table if the format is one of `OF_ONE_TABLE`, which has no names;
        FITS writes names in capitals

    Raises
    ------
    KeyError
        If there is no format of that suffix.
    ValueError
        If there are several tables, or none, for a format of one table.
    """
    suffix = path.suffix.lower()
    if suffix == _FITS:
        hdus = [_hdu(name, table) for name, table in tables.items()]
        fits.HDUList([fits.PrimaryHDU(), *hdus]).writeto(path, overwrite=True, checksum=True)
    elif suffix == _VOTABLE:
        _write_votable(tables, path)
    else:
        (table,) = tables.values()
        table.write(path, format=_OF_ONE_TABLE[suffix], overwrite=True)


def _hdu(name: str, table: Table) -> fits.BinTableHDU:
    made = fits.table_to_hdu(table, name=name)
    for number, column in enumerate(table.colnames, 1):
        if table[column].description:
            # The keyword that TOPCAT and others show as the description of the column.
            made.header[f"TCOMM{number}"] = table[column].description
    return made


def _write_votable(tables: Mapping[str, Table], path: Path) -> None:
    document = tree.VOTableFile()
    for name, table in tables.items():
        (resource,) = votable.from_table(table, table_id=name).resources
        resource.tables[0].name = name
        for key, value in table.meta.items():
            resource.infos.append(tree.Info(name=key, value=str(value)))
        document.resources.append(resource)
    document.to_xml(str(path))
