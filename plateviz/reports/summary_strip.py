"""The summary strip as HTML, for the dashboard and reports in both themes."""

from collections.abc import Iterable
from html import escape
from importlib.resources import files

from plateviz.tables import SummaryItem

STYLE = (files("plateviz.reports") / "summary_strip.css").read_text(encoding="utf-8")
"""The colours of both themes, and the classes of the strip."""


def strip(items: Iterable[SummaryItem]) -> str:
    """Return numbers as a row of tiles, each with its name and its state."""
    return f"<div class='strip'>{''.join(map(_cell, items))}</div>"


def _cell(item: SummaryItem) -> str:
    value, bracket, beside = item.value.partition(" (")
    return (
        f"<div class='cell {item.state}' title='{escape(item.hint, quote=True)}'>"
        f"<span class='name'>{escape(item.label)}</span>"
        f"<span class='value'>{escape(value)}"
        f"<span class='beside'>{escape(bracket + beside)}</span></span></div>"
    )
