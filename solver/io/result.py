"""Result files: write and read the published result layout in FITS, without loss."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from astropy.io import fits
from astropy.table import Table as RawTable

from solver.data import schema
from solver.data.instrument import instrument_from, instrument_text
from solver.data.result import FitResult
from solver.errors import InputError
from solver.io import published_layout as layout
from solver.io.atomic import sha256_of, write_atomically
from solver.io.failures import reading
from solver.io.fits import FitsFile, read_fits, read_primary_header
from solver.io.header import FORMAT, ORIGIN, primary_header, result_header, versions_in
from solver.io.outputs import FITS_SUFFIXES, check_output
from solver.io.published_layout import PublishedTable, WrittenColumn
from solver.io.result_ids import check_ids
from solver.io.settings import parse_settings

_SUMMARY = "SUMMARY"
_N_TABLES = "NTABLES"
_SECTIONS = ("summary", "settings", "provenance", "instrument")
_TOML = "toml"
# Tables that a result may lack.
_OPTIONAL = {
    "true_places": layout.TRUE_PLACES,
    "losses": layout.LOSSES,
    "outliers": layout.OUTLIERS,
    "eigenmodes": layout.MODES,
    "mode_parameters": layout.MODE_PARAMETERS,
    "mode_shifts": layout.MODE_SHIFTS,
    "orders": layout.ORDERS,
}
_KINDS = {"int64": "iu", "float64": "f", "bool": "b", "str": "SU"}


def write_result(result: FitResult, path: Path, overwrite: bool = False) -> None:
    """Write a fitted orbit in the published result layout, atomically.

    Parameters
    ----------
    result : the fitted orbit; `read_result` reads back all tables and values
    path : the FITS file
    overwrite : whether an existing file is replaced, when the new one is complete

    Raises
    ------
    InputError
        If the suffix is not that of a FITS file, `path` cannot be written, it exists and is not
        to be overwritten, or it is a file that the orbit was read from.
    """
    check_output(path, FITS_SUFFIXES, overwrite=overwrite)
    if path.exists() and sha256_of(path) in result.provenance.values():
        raise InputError(
            f"{path}: expected another file than the inputs of the solution, found one of them, "
            "which would be lost"
        )
    with write_atomically(path, overwrite) as temporary:
        hdus = fits.HDUList(
            [
                fits.PrimaryHDU(header=primary_header(result)),
                _table_hdu(
                    layout.RESULT,
                    result.sources,
                    layout.source_sigmas(result.sources),
                    result_header(result),
                ),
                _table_hdu(layout.SAMPLE, result.residuals),
                _derived_hdu("TELESCOPE", layout.exposure_columns(result)),
                _derived_hdu("DETECTOR", layout.detector_columns(result)),
                _derived_hdu("DISTORTION", layout.distortion_columns(result)),
                _table_hdu(layout.TRACE, result.trace),
                _table_hdu(layout.CALIBRATION, result.calibration),
                _table_hdu(layout.EXPOSURES, result.exposures),
                _derived_hdu(_SUMMARY, _summary_columns(result)),
            ]
        )
        for name, hdu_layout in _OPTIONAL.items():
            frame = getattr(result, name)
            if frame is not None:
                hdus.append(_table_hdu(hdu_layout, frame))
        hdus[0].header[_N_TABLES] = (len(hdus) - 1, "number of tables in this file")
        hdus.writeto(temporary, overwrite=True, checksum=True)


def read_result(path: Path) -> FitResult:
    """Read a fitted orbit that `write_result` wrote.

    Raises
    ------
    InputError
        If the file is not a result, is damaged or incomplete, or has a newer format.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: expected a result file, found none")
    return to_result(path, read_fits(path))


def read_versions(path: Path) -> dict[str, str]:
    """Return the versions of the packages used for a result; raises as `read_result`."""
    primary = read_primary_header(path)
    _check_format(path, primary)
    return versions_in(primary)


def to_result(path: Path, file: FitsFile) -> FitResult:
    """Convert the contents of the file `path` to a fitted orbit; raises as `read_result`."""
    _check_format(path, file.primary)
    sections = _read_summary(path, _table(path, file, _SUMMARY))
    settings = parse_settings(sections["settings"], f"{path}, HDU {_SUMMARY}")
    result = FitResult(
        sources=_frame(path, file, layout.RESULT),
        residuals=_frame(path, file, layout.SAMPLE),
        calibration=_frame(path, file, layout.CALIBRATION),
        exposures=_frame(path, file, layout.EXPOSURES),
        trace=_frame(path, file, layout.TRACE),
        summary=sections["summary"],
        settings=settings,
        provenance=sections["provenance"],
        instrument=instrument_from(sections["instrument"].get(_TOML), f"{path}, HDU {_SUMMARY}"),
        **{
            name: _frame(path, file, hdu_layout) if hdu_layout.hdu in file.tables else None
            for name, hdu_layout in _OPTIONAL.items()
        },
    )
    _check_count(path, file)
    check_ids(path, result)
    return result


def is_result(primary: fits.Header) -> bool:
    """Return whether a primary header is that of a plateviz result, of any version."""
    return primary.get("ORIGIN") == ORIGIN and isinstance(primary.get("FORMAT"), int)


def _check_format(path: Path, primary: fits.Header) -> None:
    if not is_result(primary):
        raise InputError(
            f"{path}: expected a result file, with ORIGIN = {ORIGIN!r} and FORMAT in the primary "
            f"header, found ORIGIN = {primary.get('ORIGIN')!r}, FORMAT = {primary.get('FORMAT')!r}"
        )
    if primary["FORMAT"] > FORMAT:
        raise InputError(
            f"{path}: expected a result of format {FORMAT} or older, found format "
            f"{primary['FORMAT']}: it was written by a newer version "
            f"({primary.get('PLATEVIZ', 'unknown')})"
        )


def _check_count(path: Path, file: FitsFile) -> None:
    # Checksums do not tell that a whole HDU is missing. Older versions did not count them.
    expected = file.primary.get(_N_TABLES, 0)
    if not isinstance(expected, int) or len(file.tables) < expected:
        raise InputError(
            f"{path}: expected {expected} tables, as its primary header says, "
            f"found {len(file.tables)}: {', '.join(file.tables)}"
        )


def _table_hdu(
    hdu_layout: PublishedTable,
    frame: pd.DataFrame,
    extra: list[WrittenColumn] | None = None,
    header: fits.Header | None = None,
) -> fits.BinTableHDU:
    columns = [
        WrittenColumn(
            hdu_layout.name(column),
            "" if column.name in hdu_layout.unitless else column.unit,
            f"[{column.unit}] {column.meaning}" if column.unit else column.meaning,
            _stored(frame[column.name], column),
        )
        for column in hdu_layout.table
    ]
    columns += extra or []
    order = {name: rank for rank, name in enumerate(layout.PUBLISHED_ORDER.get(hdu_layout.hdu, ()))}
    columns.sort(key=lambda column: order.get(column.name, len(order)))
    return _derived_hdu(hdu_layout.hdu, columns, header)


def _derived_hdu(
    name: str, columns: list[WrittenColumn], header: fits.Header | None = None
) -> fits.BinTableHDU:
    table = RawTable({column.name: column.values for column in columns})
    for column in columns:
        table[column.name].unit = column.unit or None
    hdu = fits.table_to_hdu(table)
    hdu.name = name
    hdu.header.extend(header or ())
    for number, column in enumerate(columns, 1):
        hdu.header.set(f"TCOMM{number}", column.meaning, after=f"TTYPE{number}")
    return hdu


def _stored(values: pd.Series, column: schema.Column) -> np.ndarray:
    if column.dtype == "str":
        return _text_array([_escape(text) for text in values])
    return values.to_numpy(dtype=column.dtype)


def _text_array(texts: list[str]) -> np.ndarray:
    return np.array(texts, dtype=np.str_)


def _escape(text: str) -> str:
    # FITS tables store ASCII and drop trailing spaces.
    plain = text.encode("unicode_escape").decode("ascii")
    bare = plain.rstrip(" ")
    return bare + r"\x20" * (len(plain) - len(bare))


def _unescape(text: str) -> str:
    return text.encode("ascii").decode("unicode_escape")


def _summary_columns(result: FitResult) -> list[WrittenColumn]:
    camera = {_TOML: instrument_text(result.instrument)}
    contents = (result.summary, result.settings.to_dict(), result.provenance, camera)
    rows = [
        (section, _escape(str(key)), json.dumps(value, default=_plain))
        for section, content in zip(_SECTIONS, contents, strict=True)
        for key, value in content.items()
    ]
    columns = zip(*rows, strict=True)
    return [
        WrittenColumn(name, "", meaning, _text_array(list(texts)))
        for (name, meaning), texts in zip(
            (("section", "of what"), ("key", "name"), ("value", "value, as JSON")),
            columns,
            strict=True,
        )
    ]


def _plain(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"expected plain numbers and text, got {type(value).__name__}")


def _read_summary(path: Path, table: RawTable) -> Mapping[str, dict]:
    sections: dict[str, dict] = {section: {} for section in _SECTIONS}
    with reading(f"{path}, HDU {_SUMMARY}", "columns section, key, value with JSON values"):
        for row in table:
            value = json.loads(str(row["value"]))
            sections[str(row["section"])][_unescape(str(row["key"]))] = value
    return sections


def _table(path: Path, file: FitsFile, name: str) -> RawTable:
    if name not in file.tables:
        raise InputError(
            f"{path}: expected an HDU {name} in a result file, "
            f"found {', '.join(file.tables) or 'no table'}"
        )
    return file.tables[name]


def _frame(path: Path, file: FitsFile, hdu_layout: PublishedTable) -> pd.DataFrame:
    table = _table(path, file, hdu_layout.hdu)
    found = [c for c in hdu_layout.table if hdu_layout.name(c) in table.colnames]
    missing = [hdu_layout.name(c) for c in hdu_layout.table if c.required and c not in found]
    if missing:
        raise InputError(
            f"{path}, HDU {hdu_layout.hdu}: expected the columns of a result, "
            f"found none called {', '.join(missing)}"
        )
    frame = pd.DataFrame(
        {
            c.name: _restored(table[hdu_layout.name(c)], c, f"{path}, HDU {hdu_layout.hdu}")
            for c in found
        }
    )
    return hdu_layout.table.completed(frame)


def _restored(values: np.ndarray, column: schema.Column, where: str) -> np.ndarray | pd.Series:
    array = np.asarray(values)
    if array.dtype.kind not in _KINDS[column.dtype] or array.ndim != 1:
        raise InputError(
            f"{where}, column for {column.name}: expected {column.dtype}, found {array.dtype}"
        )
    if column.dtype == "str":
        with reading(f"{where}, column for {column.name}", "escaped text"):
            return pd.Series([_unescape(text) for text in array], dtype="str")
    return array.astype(column.dtype)
