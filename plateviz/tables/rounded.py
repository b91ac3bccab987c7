"""Numbers in sentences and tables: a few significant digits, and a minus sign, not a hyphen."""

import math
import re
from decimal import Decimal

# Not a range ("0-3"), an option or a part of a name.
_NEGATIVE = re.compile(r"(?<![\w\]).=-])-(\d[\d,]*(?:\.\d+)?)")


def rounded(value: float, digits: int = 2) -> str:
    """Return a number with so many significant digits at most: "0.046", "1,200"."""
    text = f"{value:.{digits}g}"
    return with_minus_signs(f"{Decimal(text):,f}" if math.isfinite(value) else text)


def with_error(value: float, error: float, digits: int = 2) -> str:
    """Return a number with its uncertainty, both to the decimals of that: "1,240 ± 60".

    Parameters
    ----------
    error : greater than zero
    digits : significant ones of the uncertainty
    """
    last = math.floor(math.log10(float(f"{error:.{digits - 1}e}"))) - digits + 1
    texts = (f"{round(one, -last):,.{max(-last, 0)}f}" for one in (value, error))
    return with_minus_signs(" ± ".join(texts))


def with_minus_signs(text: str) -> str:
    """Return a text with minus signs in place of hyphens before numbers, and none before zero.

    "-1.5" is "−1.5", and "-0.00" is "0.00".
    """
    return _NEGATIVE.sub(lambda one: f"−{one[1]}" if _is_not_zero(one[1]) else one[1], text)


def _is_not_zero(digits: str) -> bool:
    return any(digit in "123456789" for digit in digits)
