"""The instrument of a result that was read from disk, and whether two results have the same."""

from pathlib import Path

from solver.data.instrument import MINI_MOCK, Instrument, read_instrument
from solver.data.result import FitResult
from solver.errors import InputError


def instrument_of(
    result: FitResult, path: Path | None = None, otherwise: Instrument = MINI_MOCK
) -> Instrument:
    """Return the instrument of a result.

    Parameters
    ----------
    path : the instrument as a TOML file, where a user gave one
    otherwise : of a result that keeps none, as older versions wrote them, where no file is given

    Raises
    ------
    InputError
        If the file is not an instrument, or not the one that the result keeps.
    """
    if path is None:
        return result.instrument or otherwise
    given = read_instrument(path)
    if result.instrument is not None and given != result.instrument:
        raise InputError(
            f"{path}: expected the instrument that the solution was computed with, "
            f"{result.instrument.name!r}, which it keeps, found {given.name!r} with other values; "
            "no file is needed"
        )
    return given


def require_instrument(result: FitResult, expected: Instrument, where: str, remedy: str) -> None:
    """Raise InputError if a result was computed with another instrument than expected.

    A result that keeps none passes.

    Parameters
    ----------
    where, remedy : what the result is, and what to do: the begin and the end of the message
    """
    if result.instrument not in (None, expected):
        raise InputError(
            f"{where}: expected a solution with the instrument of the measurements, "
            f"{expected.name!r}, found {result.instrument.name!r} with other values; {remedy}"
        )


def require_comparable(result: FitResult, other: FitResult) -> None:
    """Raise InputError if two results keep different instruments.

    Coefficients of the distortion, and places of detectors, mean different things then.
    """
    a, b = result.instrument, other.instrument
    if a is not None and b is not None and a != b:
        raise InputError(
            "expected two solutions with the same instrument to compare, found "
            f"{a.name!r} and {b.name!r}, whose values differ"
        )
