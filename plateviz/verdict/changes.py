"""Rows of the tables of changes: settings that differ, and figures of merit with B minus A."""

import math
from typing import Any

from plateviz.tables.rounded import with_minus_signs
from solver.data.setting_kinds import EngineSettings
from solver.data.settings import DEFAULTS, SETTINGS, FitSettings
from solver.data.text_setting import PriorWidths

COLUMNS = ("what", "a", "b", "change")
Row = tuple[str, str, str, str]
"""Texts of `COLUMNS`."""


def setting_changes(a: FitSettings, b: FitSettings) -> list[Row]:
    """Return a row per setting that differs; its change is empty."""
    rows = []
    for name, one in SETTINGS.items():
        of_a, of_b = getattr(a, name), getattr(b, name)
        if of_a != of_b:
            rows.append((one.label, _described(name, of_a), _described(name, of_b), ""))
    return rows


def _described(name: str, value: Any) -> str:  # noqa: ANN401 any setting
    """Return a setting in words, also one that the description of a solution leaves out."""
    one = SETTINGS[name]
    if words := ", ".join(one.described(value, DEFAULTS[name])):
        return words
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float | str) and value:
        return one.phrase.format(value)
    # Without widths of its own, a fit has those of the paper.
    return "default" if isinstance(one, PriorWidths | EngineSettings) else "none"


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
