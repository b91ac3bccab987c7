"""Numbers in sentences: a few significant digits, never an exponent."""

import math
from decimal import Decimal


def rounded(value: float, digits: int = 2) -> str:
    """Return a number with so many significant digits at most: "0.046", "1,200"."""
    text = f"{value:.{digits}g}"
    return f"{Decimal(text):,f}" if math.isfinite(value) else text
