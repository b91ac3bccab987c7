"""Column checks: convert one raw column to the type and unit of the schema, and check it."""

import warnings
from typing import NamedTuple

import numpy as np
from astropy.table import Column as RawColumn
from astropy.time import Time
from astropy.units import Quantity, Unit, UnrecognizedUnit
from astropy.utils.masked import Masked

from solver.data.columns import Column
from solver.data.plural import plural

# Units in which float32 is too coarse: 110 mas at 266 deg, minutes in MJD.
_UNITS_IN_FLOAT64 = ("deg", "d")
_SCALES = ("utc", "tai", "tt", "tcg", "tdb", "tcb")
_TIME_FORMAT = {"d": "mjd", "yr": "jyear"}
_LOGICALS = {"t": True, "true": True, "f": False, "false": False}


class Converted(NamedTuple):
    """Converted values of one column, and their problems.

    Attributes
    ----------
    values : values in the canonical type and unit; None if they cannot be converted
    problems : one message per problem; empty if the values can be used
    """

    values: np.ndarray | None
    problems: list[str]


def convert(raw: RawColumn | Quantity | Time, column: Column, where: str) -> Converted:
    """Convert one raw column to the type and unit of `column`, and check every value.

    Parameters
    ----------
    raw : a column of an astropy table, masked or not
    column : definition of the expected column
    where : the file, table and column, for messages

    Returns
    -------
    Values of the canonical type in the canonical unit. Integers are never converted to
    floats on the way; times become MJDs or Julian years in TCB; a column without a unit is
    assumed to have the canonical one.
    """
    if isinstance(raw, Time):
        return _from_time(raw, column, where)
    values, missing = _split(raw)
    if values.ndim != 1:
        return _refused(where, "one value per row", f"an array of shape {values.shape[1:]}")
    if missing.any() and column.may_be_nan and values.dtype.kind in "iuf":
        values = np.where(missing, np.nan, values)
    elif missing.any():
        return _refused(where, "a value in every row", _rows(missing, "without one"))
    if column.dtype == "float64":
        return _floats(values, getattr(raw, "unit", None), column, where)
    return {"int64": _integers, "bool": _logicals, "str": _texts}[column.dtype](values, where)


def missing_rows(raw: RawColumn | Quantity | Time) -> np.ndarray:
    """Return which rows of a raw column have no value: masked, NaN or infinite."""
    if isinstance(raw, Time):
        return np.asarray(raw.mask)
    values, missing = _split(raw)
    if values.dtype.kind == "f":
        missing = missing | ~np.isfinite(values)
    return np.asarray(missing.any(axis=tuple(range(1, missing.ndim))))


def _refused(where: str, expected: str, found: str) -> Converted:
    return Converted(None, [f"{where}: expected {expected}, found {found}"])


def _rows(bad: np.ndarray, what: str) -> str:
    first, count = int(np.argmax(bad)) + 1, int(bad.sum())
    return f"{count} of {bad.size} {plural(bad.size, 'row')} {what}, the first is row {first}"


def _split(raw: RawColumn | Quantity) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(raw, Masked):
        return np.asarray(raw.unmasked), np.asarray(raw.mask)
    return np.asarray(np.ma.getdata(raw)), np.ma.getmaskarray(raw)


def _from_time(raw: Time, column: Column, where: str) -> Converted:
    if column.unit not in _TIME_FORMAT:
        return _refused(where, f"numbers in {column.unit or 'no unit'}", "times")
    missing = np.asarray(raw.mask)
    if missing.any():
        return _refused(where, "a time in every row", _rows(missing, "without one"))
    # Others need the rotation of the Earth, of which astropy would download the latest table.
    if raw.scale not in _SCALES:
        return _refused(where, f"a time scale out of {', '.join(_SCALES)}", f"{raw.scale!r}")
    with warnings.catch_warnings():
        # ERFA warns of UTC years beyond its leap-second table.
        warnings.simplefilter("ignore")
        values = np.asarray(raw.tcb.to_value(_TIME_FORMAT[column.unit]), dtype=np.float64)
    return Converted(values, _value_problems(values, column, where))


def _floats(values: np.ndarray, unit: Unit | None, column: Column, where: str) -> Converted:
    if values.dtype.kind not in "iuf":
        return _refused(where, "numbers", _kind(values))
    if values.dtype.kind == "f" and values.itemsize < 8 and column.unit in _UNITS_IN_FLOAT64:
        return _refused(where, "float64, for its precision", str(values.dtype))
    canonical = Unit(column.unit)
    if isinstance(unit, UnrecognizedUnit):
        # The unit format of old VOTables does not include "mas.yr**-1".
        unit = Unit(str(unit), parse_strict="silent")
    converted = values.astype(np.float64)
    if unit is not None and unit not in (Unit(""), canonical):
        if isinstance(unit, UnrecognizedUnit):
            return _refused(where, f"the unit {column.unit!r}", f"an unknown unit {str(unit)!r}")
        if not unit.is_equivalent(canonical):
            return _refused(where, f"a unit convertible to {column.unit!r}", repr(str(unit)))
        converted = unit.to(canonical, converted)
    return Converted(converted, _value_problems(converted, column, where))


def _value_problems(values: np.ndarray, column: Column, where: str) -> list[str]:
    found = []
    finite = np.isfinite(values)
    if not finite.all() and not column.may_be_nan:
        found.append(f"{where}: expected finite numbers, found {_rows(~finite, 'NaN or infinite')}")
    low, high = column.limits
    bad = finite & ((values < low) | (values > high))
    if bad.any():
        value = float(values[np.argmax(bad)])
        found.append(
            f"{where}: expected values {limits_text(column)} ({column.meaning}), "
            f"found {value!r}: {_rows(bad, 'invalid')}"
        )
    return found


def limits_text(column: Column) -> str:
    """Return the limits of a column as text, such as "from -90 to 90 deg"; "" without limits."""
    low, high = column.limits
    return f"from {low:g} to {high:g} {column.unit}".rstrip() if np.isfinite(low) else ""


def _integers(values: np.ndarray, where: str) -> Converted:
    if values.dtype.kind not in "iu":
        found = _kind(values)
        if values.dtype.kind == "f":
            found += ", which cannot hold ids beyond 2**53 exactly"
        return _refused(where, "integers (int64)", found)
    if values.dtype.kind == "u" and values.size and values.max() > np.iinfo(np.int64).max:
        return _refused(where, "integers (int64)", f"{values.max()}, beyond int64")
    return Converted(values.astype(np.int64), [])


def _logicals(values: np.ndarray, where: str) -> Converted:
    expected = "true or false (bool, 0 or 1, 'T' or 'F')"
    if values.dtype.kind == "b":
        return Converted(values.astype(bool), [])
    if values.dtype.kind in "iu":
        bad = (values != 0) & (values != 1)
        if bad.any():
            return _refused(where, expected, f"{values[bad][0]}: {_rows(bad, 'invalid')}")
        return Converted(values == 1, [])
    if values.dtype.kind in "SUO":
        texts = [text.strip().lower() for text in _as_text(values)]
        bad = np.array([text not in _LOGICALS for text in texts], dtype=bool)
        if bad.any():
            found = f"{texts[int(np.argmax(bad))]!r}: {_rows(bad, 'invalid')}"
            return _refused(where, expected, found)
        return Converted(np.array([_LOGICALS[text] for text in texts], dtype=bool), [])
    return _refused(where, expected, _kind(values))


def _texts(values: np.ndarray, where: str) -> Converted:
    if values.dtype.kind not in "SUO":
        return _refused(where, "text", _kind(values))
    return Converted(np.array(_as_text(values), dtype=object), [])


def _as_text(values: np.ndarray) -> list[str]:
    return [v.decode("ascii", "replace") if isinstance(v, bytes) else str(v) for v in values]


def _kind(values: np.ndarray) -> str:
    if values.dtype.kind in "SUO" and values.size:
        return f"text such as {_as_text(values[:1])[0]!r}"
    return str(values.dtype)
