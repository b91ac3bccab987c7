"""What *Explore* draws as text, the same in an address, on the command line and in Python."""

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any
from urllib.parse import parse_qsl, urlencode

from plateviz.plots.explore.explored_rows import ExploredColumns
from solver.errors import InputError

SWITCHES: Mapping[str, str] = MappingProxyType(
    {"is_log_x": "log x", "is_log_y": "log y", "has_median": "median"}
)
"""Names of the switches, and what they are called on the page."""
_NUMBER = r"-?(?:\d+(?:\.\d*)?(?:e[+-]?\d+)?|inf)"
_NUMBERS = re.compile(rf"{_NUMBER}(?:~{_NUMBER})*")
# Of a wrong value in a message, characters.
_LONGEST = 80
_KEYS = ("rows", "x", "y", "colour", "only", "between", "with", "selects", "zoom")


def parts_of(rows: str, chosen: ExploredColumns) -> dict[str, str]:
    """Return what is drawn as parts of an address.

    Parameters
    ----------
    rows : what a row is, such as "measurements"
    """
    parts = {"rows": rows, "x": chosen.x, "y": chosen.y}
    parts |= {name: getattr(chosen, name) for name in ("colour", "only") if getattr(chosen, name)}
    if chosen.only and (chosen.lowest, chosen.highest) != (-math.inf, math.inf):
        parts["between"] = _joined((chosen.lowest, chosen.highest))
    switches = [name for name in SWITCHES if getattr(chosen, name)]
    if switches:
        parts["with"] = ",".join(switches)
    if chosen.selects != ExploredColumns.selects:
        parts["selects"] = chosen.selects
    if chosen.limits is not None:
        parts["zoom"] = _joined((*chosen.limits[0], *chosen.limits[1]))
    return parts


def text_of(rows: str, chosen: ExploredColumns) -> str:
    """Return what is drawn as one text, "rows=measurements&x=focal_x&y=residual_x"."""
    return urlencode(parts_of(rows, replace(chosen, selects=ExploredColumns.selects)), safe="~,")


def parse_explored(text: str) -> tuple[str, ExploredColumns]:
    """Return what a row is and what is drawn, from `text_of` or the same part of an address.

    Raises
    ------
    InputError
        If a part is missing, unknown or invalid. Whether there are such rows and columns is
        not known here.
    """
    parts = dict(parse_qsl(text, keep_blank_values=True))
    unknown = sorted(set(parts) - set(_KEYS))
    if unknown or not {"rows", "x", "y"} <= set(parts):
        raise InputError(
            "explore: expected parts such as rows=measurements&x=focal_x&y=residual_x out of "
            f"{', '.join(_KEYS)}, found {_quoted(text)}"
        )
    chosen = ExploredColumns(parts["x"], parts["y"], parts.get("colour", ""), parts.get("only", ""))
    switches, limits, problems = read_parts(parts)
    if problems:
        raise InputError(f"explore: {problems[0]}")
    return parts["rows"], replace(chosen, **switches, **limits)


def read_parts(
    parts: Mapping[str, str],
) -> tuple[dict[str, bool], dict[str, Any], list[str]]:
    """Return the switches and the limits of `ExploredColumns` in parts of an address.

    Returns
    -------
    The switches that are on, the limits, and what of the parts is invalid, in words.
    """
    wanted = list(filter(None, parts.get("with", "").split(",")))
    problems = [
        f"with: expected {', '.join(SWITCHES)}, found {_quoted(name)}"
        for name in wanted
        if name not in SWITCHES
    ]
    limits: dict[str, Any] = {}
    for name, count in (("between", 2), ("zoom", 4)):
        if name not in parts:
            continue
        numbers = _numbers_in(parts[name], count)
        if numbers is None or (name == "zoom" and not all(map(math.isfinite, numbers))):
            found = _quoted(parts[name])
            problems.append(f"{name}: expected {count} numbers with ~ between them, found {found}")
        elif name == "between":
            limits |= {"lowest": numbers[0], "highest": numbers[1]}
        else:
            limits["limits"] = (numbers[:2], numbers[2:])
    return {name: True for name in SWITCHES if name in wanted}, limits, problems


def require_columns(chosen: ExploredColumns, rows: str, names: Collection[str]) -> None:
    """Raise `InputError` if a column that is drawn is not among those of the rows."""
    for name in filter(None, (chosen.x, chosen.y, chosen.colour, chosen.only)):
        if name not in names:
            raise InputError(
                f"explore: expected a column of the {rows} out of {', '.join(names)}, "
                f"found {name!r}"
            )


def require_rows(rows: str, known: Collection[str]) -> None:
    """Raise `InputError` if there are no such rows."""
    if rows not in known:
        raise InputError(f"explore: expected rows out of {', '.join(known)}, found {rows!r}")


def _numbers_in(text: str, count: int) -> tuple[float, ...] | None:
    """Return the numbers of a part of an address; None if they are not numbers or not so many."""
    if not _NUMBERS.fullmatch(text):
        return None
    numbers = tuple(map(float, text.split("~")))
    return numbers if len(numbers) == count else None


def _quoted(text: str) -> str:
    return repr(text[:_LONGEST])


def _joined(numbers: tuple[float, ...]) -> str:
    # Every digit: who reads it must see the same rows.
    return "~".join(f"{number!r}" for number in numbers)
