"""Parts of an address: their values, and what is said of invalid ones."""

import re
from collections.abc import Collection, Iterable, Mapping
from typing import TypeVar

_Name = TypeVar("_Name")
# Characters of an invalid value that a message repeats.
_LONGEST = 40
# Parts that a message names.
_MOST_NAMED = 3
# Bokeh adds some where the page is a part of another one, and Panel reads its theme.
_OF_OTHERS = re.compile("bokeh-.*|theme")


def quoted(value: object) -> str:
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
    problems.append(f"{name}: expected {', '.join(options) or 'none'}, found {quoted(value)}")
    return default


def unknown_parts(address: Mapping[str, str], known: Collection[str]) -> list[str]:
    """Return that parts of an address are unknown, in words; nothing if all are known."""
    names = [one for one in address if one not in known and not _OF_OTHERS.fullmatch(one)]
    told = _listed([quoted(one) for one in names])
    return [f"unknown parts, as of another version: {told}"] if told else []


def repeated_parts(address: Mapping[str, Collection[object]]) -> list[str]:
    """Return which parts an address has more than once with different values, in words."""
    repeated = {name: len(values) for name, values in address.items() if len({*values}) > 1}
    told = _listed([f"{quoted(name)} {count} times" for name, count in repeated.items()])
    first = "the first one" if len(repeated) == 1 else "the first of each"
    return [f"the address gives {told}, and {first} is shown"] if told else []


def _listed(words: list[str]) -> str:
    """Return the first of some words, and how many there are besides."""
    more = f" and {len(words) - _MOST_NAMED} more" if len(words) > _MOST_NAMED else ""
    return ", ".join(words[:_MOST_NAMED]) + more
