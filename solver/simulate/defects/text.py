"""A defect as text: NAME=AMPLITUDE, such as "distortion-drift=0.1um"."""

import re
from collections.abc import Iterable

from solver.data.quantity_text import QUANTITY, shortest, unit_factor
from solver.errors import InputError
from solver.simulate.defects.defect import Defect
from solver.simulate.defects.table import BY_NAME

_AMPLITUDE = re.compile(QUANTITY)


def parse_defects(texts: Iterable[str]) -> dict[str, float]:
    """Return name -> amplitude, in the unit of each defect, in the order of the table.

    Parameters
    ----------
    texts : "NAME=AMPLITUDE" each

    Raises
    ------
    InputError
        If a name, an amplitude or its unit is invalid, or a defect is given twice.
    """
    found: dict[str, float] = {}
    for text in texts:
        defect, amplitude = _parsed(text)
        if defect.name in found:
            raise InputError(f"defect {defect.name}: expected it once, found it again in {text!r}")
        found[defect.name] = amplitude
    return {name: found[name] for name in BY_NAME if name in found}


def format_defect(name: str, amplitude: float) -> str:
    """Return a defect as a text that `parse_defects` reads."""
    return f"{name}={shortest(amplitude)}{BY_NAME[name].unit}"


def _parsed(text: object) -> tuple[Defect, float]:
    if not isinstance(text, str):
        raise InputError(f"expected a defect as text, NAME=AMPLITUDE, found {text!r}")
    name, found, value = (part.strip() for part in text.partition("="))
    if name not in BY_NAME:
        known = ", ".join(f"{one.name}={one.example}" for one in BY_NAME.values())
        raise InputError(f"expected a defect out of {known}, found {name!r}")
    defect = BY_NAME[name]
    match = _AMPLITUDE.fullmatch(value)
    # A number alone could be meant as a fraction or in another unit.
    if not found or match is None or (defect.unit and match["unit"] is None):
        raise InputError(
            f"defect {name}: expected an amplitude such as {name}={defect.example}, found {text!r}"
        )
    amplitude = float(match["number"]) * unit_factor(f"defect {name}", match["unit"], defect.unit)
    if not defect.low <= amplitude <= defect.high or (defect.is_count and amplitude % 1):
        kind = "a whole number" if defect.is_count else "an amplitude"
        unit = f" {defect.unit}" if defect.unit else ""
        raise InputError(
            f"defect {name}: expected {kind} from {defect.low:g} to {defect.high:g}{unit}, "
            f"found {value!r}"
        )
    return defect, amplitude
