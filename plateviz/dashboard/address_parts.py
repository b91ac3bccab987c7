"""Parts of an address: their values, and what is said of invalid ones."""

from collections.abc import Iterable, Mapping
from typing import TypeVar

_Name = TypeVar("_Name")
# Characters of an invalid value that a message repeats.
_LONGEST = 40


def in_words(value: object) -> str:
    """Return a value of an address for a message."""
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def chosen(
    name: str,
    address: Mapping[str, str],
    options: Iterable[str],
    default: _Name,
    problems: list[str],
) -> str | _Name:
    """Return a part of an address; if it is none of the options, add why to `problems`."""
    value = address.get(name)
    if value is None:
        return default
    if value in options:
        return value
    problems.append(f"{name}: expected {', '.join(options) or 'none'}, found {in_words(value)}")
    return default
