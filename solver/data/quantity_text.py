"""Quantities as text: a number with an optional unit, such as "0.1um", "10 %" or "7.6km/s"."""

from solver.errors import InputError
from solver.units import factor_between

# A pattern with the groups `number` and `unit`.
QUANTITY = (
    r"(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>%|[^\W\d]\w*(?:/\w+)?)?"
)


def shortest(number: float) -> str:
    """Return the shortest text that is read back as the same number."""
    text = f"{number:.6g}"
    return text if float(text) == number else repr(float(number))


def unit_factor(what: str, given: str | None, unit: str) -> float:
    """Return how many of `unit` make one of the unit that a text gives; 1 if it gives none.

    Parameters
    ----------
    what : what the quantity is, for messages
    given : unit in the text
    unit : unit of the result; "" for a number without unit

    Raises
    ------
    InputError
        If the given unit is unknown or of another kind.
    """
    if given is None:
        return 1.0
    try:
        if unit:
            return factor_between(given, unit)
    except ValueError:
        pass
    expected = f"a unit such as {unit}" if unit else "a number without unit"
    raise InputError(f"{what}: expected {expected}, found {given!r}")
