"""Text of numbers with their units: angles and numbers of orbits."""

import math

from plateviz.tables.rounded import with_minus_signs
from solver.units import UAS_PER_MAS

_UAS_BELOW_MAS = 0.5
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# Sizes of numbers that need no power of ten.
_PLAIN = (1e-3, 1e6)
# Units, each a thousandth of the one before it.
_FINER = {"arcsec": ("arcsec", "mas", "µas"), "µm": ("µm", "nm", "pm")}
_PER_STEP = 1000.0


def angle_unit(size_mas: float) -> tuple[str, float]:
    """Return the unit for angles of `size_mas`, µas or mas, and the factor from mas to it."""
    small = math.isfinite(size_mas) and size_mas < _UAS_BELOW_MAS
    return ("µas", UAS_PER_MAS) if small else ("mas", 1.0)


def angle_text(value_mas: float) -> str:
    """Return an angle to two or three digits with its unit: "4.2 mas", "85 µas"."""
    unit, factor = angle_unit(abs(value_mas))
    return f"{number_text(value_mas * factor, 2)} {unit}"


def finer_unit(size: float, unit: str) -> tuple[str, float]:
    """Return the unit in which `size` is at least one, and the factor from `unit` to it.

    Parameters
    ----------
    size : typical value, positive
    unit : "arcsec" or "µm"; another one stays, and so does one that has no finer unit
    """
    units = _FINER.get(unit, (unit,))
    step = min(max(0, math.ceil(-math.log10(size) / 3.0 - 1e-9)), len(units) - 1)
    return units[step], _PER_STEP**step


def power_text(value: float, digits: int) -> str:
    """Return a number to so many digits, a very small or large one with a power of ten.

    Such as "0.026", or "7.2 × 10⁻¹²" where seven digits or leading zeros would be needed.
    """
    text = with_minus_signs(f"{value:,.{digits}g}")
    if value and math.isfinite(value) and not _PLAIN[0] <= abs(value) < _PLAIN[1]:
        number, power = f"{value:.{digits - 1}e}".split("e")
        text = f"{with_minus_signs(number)} × 10{str(int(power)).translate(_RAISED)}"
    return text


def number_text(value: float, digits: int) -> str:
    """Return a number to so many digits, or more if it is large, with at most six decimals."""
    known = value and math.isfinite(value)
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value)))) if known else 0
    return with_minus_signs(f"{value:,.{min(decimals, 6)}f}")
