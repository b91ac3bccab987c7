"""Rows of the tables of changes: settings that differ, and figures of merit with B minus A."""

import math

from plateviz.tables.rounded import with_minus_signs
from solver.data.settings import DEFAULTS, SETTINGS, FitSettings

COLUMNS = ("what", "a", "b", "change")
Row = tuple[str, str, str, str]
"""Texts of `COLUMNS`."""


def setting_changes(a: FitSettings, b: FitSettings) -> list[Row]:
    """Return a row per setting that differs; its change is empty."""
    rows = []
    for name, one in SETTINGS.items():
        of_a, of_b = getattr(a, name), getattr(b, name)
        if of_a != of_b:
            a_text, b_text = (
                ", ".join(one.described(value, DEFAULTS[name])) or "default"
                for value in (of_a, of_b)
            )
            rows.append((one.label, a_text, b_text, ""))
    return rows


def merit(label: str, a: object, b: object, decimals: int) -> Row:
    """Return the row of a figure of merit; what is no number is empty."""
    numbers = [float(one) if isinstance(one, int | float) else math.nan for one in (a, b)]
    change = numbers[1] - numbers[0]
    # A count that is the same has no sign; other numbers are the same to so many decimals only.
    sign = "" if decimals == 0 and change == 0.0 else "+"
    difference = "" if math.isnan(change) else with_minus_signs(f"{change:{sign},.{decimals}f}")
    return label, _number(numbers[0], decimals), _number(numbers[1], decimals), difference


def _number(value: float, decimals: int) -> str:
    return "" if math.isnan(value) else f"{value:,.{decimals}f}"
