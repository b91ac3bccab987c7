"""The summary strip as HTML, for the dashboard and reports in both themes."""

import math
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files

from plateviz.tables import SummaryItem

STYLE = (files("plateviz.reports") / "summary_strip.css").read_text(encoding="utf-8")
"""The colours of both themes, and the classes of the strip."""
# Tiles that share a row in any window.
_FEW = 4


def strip(items: Iterable[SummaryItem], others: Iterable[SummaryItem] = ()) -> str:
    """Return numbers as a row of tiles, each with its name and its state, and a line of counts.

    Parameters
    ----------
    others : of the solution (A) that is compared with; values that differ stand in the same tile
    """
    of_a = {one.label: one for one in others}
    tiles, counts = [], []
    for item in items:
        (counts if item.is_count else tiles).append(_cell(item, of_a.get(item.label)))
    line = f"<div class='counts'>{''.join(counts)}</div>" if counts else ""
    return f"<div class='strip'>{_in_rows(tiles)}</div>{line}"


def _in_rows(tiles: Sequence[str]) -> str:
    """Return tiles whose style knows how many share a row in a wide and in a narrower window."""
    n = len(tiles)
    half = n if n <= _FEW else math.ceil(n / 2)
    third = half if n <= 2 * _FEW else math.ceil(n / 3)
    style = f"--row:{max(1, n)};--half:{max(1, half)};--third:{max(1, third)}"
    return f"<div class='tiles' style='{style}'>{''.join(tiles)}</div>"


def _cell(item: SummaryItem, other: SummaryItem | None) -> str:
    value, bracket, beside = item.value.partition(" (")
    return (
        f"<div class='cell {item.state}' title='{escape(item.hint, quote=True)}'>"
        f"<span class='name'>{escape(item.label)}</span>"
        f"<span class='values'><span class='value'>{escape(value)}</span>"
        f"<span class='beside'>{escape(bracket + beside)}</span>{_other(item, other)}</span></div>"
    )


def _other(item: SummaryItem, other: SummaryItem | None) -> str:
    if other is None:
        return ""
    if other.value == item.value:
        # As high as in the other tiles, where it stands below the value.
        return "" if item.is_count else "<span class='other'>&nbsp;</span>"
    value = other.value.partition(" (")[0]
    return f"<span class='other {other.state}'>(A) {escape(value)}</span>"
