"""The instrument of a result that was read from disk."""

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
