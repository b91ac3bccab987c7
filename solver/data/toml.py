"""TOML: read with the limits of the standard, and written, which Python's library does not do."""

import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from solver.errors import InputError

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_LARGEST_INTEGER = 2**63 - 1


def parse_toml(text: str, path: Path | str, expected: str) -> dict[str, Any]:
    """Return the content of a TOML text.

    Parameters
    ----------
    path : file name for error messages
    expected : description of the expected content

    Raises
    ------
    InputError
        If the text is not TOML, is nested too deeply, or has an integer of more than 64 bits,
        which the standard excludes and Python may be unable to show.
    """
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: expected {expected}, found: {error}") from error
    if any(abs(number) > _LARGEST_INTEGER for number in _integers(content)):
        raise InputError(
            f"{path}: expected {expected}, found an integer that does not fit into 64 bits"
        )
    return content


def toml_text(content: Mapping[str, object]) -> str:
    """Return a mapping of text, numbers, lists and mappings as TOML; mappings become tables."""
    lines = [f"{k} = {_value(v)}" for k, v in content.items() if not isinstance(v, Mapping)]
    for key, table in content.items():
        if isinstance(table, Mapping):
            lines += ["", f"[{key}]", *(f"{_key(k)} = {_value(v)}" for k, v in table.items())]
    return "\n".join(lines) + "\n"


def _integers(value: object) -> Iterator[int]:
    if isinstance(value, int):
        yield value
    elif isinstance(value, Mapping | list):
        for item in value.values() if isinstance(value, Mapping) else value:
            yield from _integers(item)


def _key(name: str) -> str:
    return name if _BARE_KEY.fullmatch(name) else json.dumps(name)


def _value(value: object) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_value(item)}" for k, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, str) and "\n" in value:
        text = value.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
        return f'"""\n{text}"""'
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    # Text, numbers and booleans have the same form in JSON and TOML, except for the one control
    # character that JSON does not escape.
    return json.dumps(value).replace("\x7f", "\\u007f")
