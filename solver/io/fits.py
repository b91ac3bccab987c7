"""FITS files: check the headers before reading any data, then read all tables."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from astropy.io import fits
from astropy.table import Column, MaskedColumn, Table

from solver.errors import InputError
from solver.io.failures import reading
from solver.io.fits_extent import extents

_VALID_LOGICALS = (ord("T"), ord("F"))


@dataclass(frozen=True)
class FitsFile:
    """Contents of a FITS file.

    Attributes
    ----------
    primary : the primary header
    tables : HDU name -> table, in file order; HDUs without a name are `hdu1`, `hdu2`...
    """

    primary: fits.Header
    tables: dict[str, Table]


def read_fits(path: Path) -> FitsFile:
    """Read the primary header and every table of a FITS file.

    Sizes in the headers are compared with the size of the file before any data are read, so
    that a wrong header cannot exhaust the memory. Checksums, if present, must be valid.

    Parameters
    ----------
    path : an uncompressed FITS file

    Returns
    -------
    Tables with native byte order and the units of the file. NaN stays NaN; nulls of the file
    are masked.

    Raises
    ------
    InputError
        If the file is incomplete or invalid; the message names the HDU.
    """
    expected = extents(Path(path))
    with (
        reading(str(path), "a FITS file"),
        fits.open(path, memmap=False, disable_image_compression=True) as hdus,
    ):
        # astropy stops at a header that it cannot read, with only a warning.
        if len(hdus) < len(expected):
            raise InputError(
                f"{expected[len(hdus)].where}: expected a valid header, found a damaged one"
            )
        tables: dict[str, Table] = {}
        for index, hdu in enumerate(hdus):
            _check_checksums(path, index, hdu)
            if isinstance(hdu, fits.BinTableHDU | fits.TableHDU):
                name = hdu.name or f"hdu{index}"
                if name in tables:
                    raise InputError(
                        f"{path}, HDU {index}: expected each HDU name once, found {name} again"
                    )
                tables[name] = _read_table(_where(path, index, hdu), hdu)
        return FitsFile(_parsed(hdus[0].header), tables)


def read_primary_header(path: Path) -> fits.Header:
    """Read the primary header of a FITS file; raises as `read_fits`."""
    extents(Path(path))
    with (
        reading(str(path), "a FITS file"),
        fits.open(path, memmap=False, disable_image_compression=True) as hdus,
    ):
        _check_checksums(path, 0, hdus[0])
        return _parsed(hdus[0].header)


def _parsed(header: fits.Header) -> fits.Header:
    """Return a header, after parsing its cards: astropy parses each when it is first used."""
    list(header.values())
    return header


def _where(path: Path, index: int, hdu: fits.PrimaryHDU) -> str:
    return f"{path}, HDU {getattr(hdu, 'name', '') or index}"


def _check_width(where: str, hdu: fits.BinTableHDU) -> None:
    width, taken = hdu.header["NAXIS1"], hdu.columns.dtype.itemsize
    if taken != width:
        raise InputError(
            f"{where}: expected rows of {width} bytes (NAXIS1), "
            f"found columns that take {taken} (TFORM)"
        )


def _check_checksums(path: Path, index: int, hdu: fits.PrimaryHDU) -> None:
    # astropy only warns of wrong checksums, so each is verified here; 0 means wrong.
    where = _where(path, index, hdu)
    with reading(where, "valid checksums"):
        wrong = [
            keyword
            for keyword, verify in (
                ("DATASUM", hdu.verify_datasum),
                ("CHECKSUM", hdu.verify_checksum),
            )
            if verify() == 0
        ]
    if wrong:
        raise InputError(
            f"{where}: expected the contents that its checksums were made of, "
            f"found a wrong {' and '.join(wrong)}: the file is corrupt"
        )


def _read_table(where: str, hdu: fits.BinTableHDU) -> Table:
    with reading(where, "a table"):
        if isinstance(hdu, fits.BinTableHDU):
            _check_width(where, hdu)
        table = Table.read(hdu, astropy_native=True, mask_invalid=False, unit_parse_strict="silent")
        nulls = _null_logicals(hdu)
        for name in table.colnames:
            if isinstance(table[name], Column):
                table.replace_column(name, _native(table[name], nulls.get(name)))
        return table


def _null_logicals(hdu: fits.BinTableHDU) -> dict[str, np.ndarray]:
    # astropy reads every logical that is not T as False, a null (zero byte) included.
    if not isinstance(hdu, fits.BinTableHDU):
        return {}
    raw = hdu.data.view(np.ndarray)
    logicals = (column.name for column in hdu.columns if column.format in ("L", "1L"))
    return {name: ~np.isin(raw[name], _VALID_LOGICALS) for name in logicals}


def _native(column: Column, nulls: np.ndarray | None) -> Column:
    values = column
    if column.dtype.kind in "iufc":
        values = column.astype(column.dtype.newbyteorder("="))
    if nulls is not None and nulls.any():
        return MaskedColumn(values, mask=nulls)
    return values
