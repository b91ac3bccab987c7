"""Unread queries: addresses that Panel cannot read, which would keep their page from opening.

Panel reads the query of every address for components that are to follow it, of which the page has
none, and raises for what looks like a number and is none, such as a superscript. It decodes the
theme that an address may name, whatever its bytes are.
"""

from collections.abc import Mapping
from functools import wraps
from typing import Any

from panel.io import location as panel_location

# It has no public name there. A test, run with the newest Panel too, notices a change.
_PANEL: Any = panel_location
_THEMES = ([b"default"], [b"dark"])


def ignore_unreadable_queries() -> None:
    """Let Panel in this process read a query that it cannot read as one without parts."""
    read = _PANEL.parse_query
    if hasattr(read, "__wrapped__"):
        return

    @wraps(read)
    def read_leniently(query: str) -> dict[str, Any]:
        try:
            return read(query)
        except ValueError:
            return {}

    _PANEL.parse_query = read_leniently


def readable(arguments: Mapping[str, list[bytes]]) -> dict[str, list[bytes]]:
    """Return the parts of an address without a theme that is none."""
    return {k: v for k, v in arguments.items() if k != "theme" or v in _THEMES}
