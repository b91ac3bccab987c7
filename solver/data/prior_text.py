"""Prior widths and shifts of prior centres as text."""

import math
import re

from solver.data.parameters import BY_NAME, Group
from solver.data.quantity_text import QUANTITY, shortest, unit_factor
from solver.errors import InputError

# Widths that can be squared, inverted and added to what the measurements say.
_NARROWEST, _WIDEST = 1e-9, 1e9
_WIDTH = re.compile(rf"(?P<flat>flat|inf)|{QUANTITY}")
_SHIFT = re.compile(QUANTITY)
_SHIFTED = re.compile(r"(?P<group>\w+)\s*(?:\[\s*(?P<element>[^\[\]\s]+)\s*\])?")


def group_named(name: str) -> Group:
    """Return a parameter group; for an unknown name, `InputError` lists all groups."""
    if name not in BY_NAME:
        raise InputError(f"expected a parameter group out of {', '.join(BY_NAME)}, found {name!r}")
    return BY_NAME[name]


def check_width(name: str, width: float) -> None:
    """Check that a prior of the group can have a width.

    Raises
    ------
    InputError
        If there is no such group, or the width is not positive, or infinite for the sources.
    """
    group_named(name)
    if not width > 0 or math.isnan(width):
        raise InputError(f"expected a positive prior width for {name}, found {width!r}")
    if not _NARROWEST <= width <= _WIDEST and not math.isinf(width):
        unit = BY_NAME[name].width_unit
        raise InputError(
            f"expected a prior width from {_NARROWEST:g} to {f'{_WIDEST:g} {unit}'.strip()} or "
            f"'flat' for {name}, found {width!r}"
        )
    if name == "sources" and math.isinf(width):
        raise InputError(
            "expected a finite factor on the catalogue's uncertainties for sources, found inf; "
            "only the reference sources constrain the solution on the sky"
        )


def check_shift(name: str, shift: float) -> None:
    """Check the shift of a prior centre.

    Parameters
    ----------
    name : as `split_name` reads it

    Raises
    ------
    InputError
        If there is no such group, the shift is not finite, or the sources have no direction.
    """
    group, element = split_name(name)
    if not math.isfinite(shift):
        raise InputError(f"expected a finite shift of the prior's centre of {name}, found {shift}")
    if group.axis == "src" and element not in ("ra", "dec"):
        raise InputError(
            f"expected sources[ra] or sources[dec], for the whole catalogue, found {name!r}"
        )


def split_name(name: str) -> tuple[Group, str | None]:
    """Return the group and the element, or None, of "GROUP[ELEMENT]" or "GROUP"."""
    match = _SHIFTED.fullmatch(name.strip())
    if match is None:
        raise InputError(f"expected GROUP or GROUP[ELEMENT], found {name!r}")
    return group_named(match["group"]), match["element"]


def parse_width(name: str, text: str) -> float:
    """Return the prior width in a text for group `name`, in its `width_unit`.

    Parameters
    ----------
    text : a number, with a unit if the group has one ("0.5 deg", "2um", "0.01"), or "flat"

    Raises
    ------
    InputError
        If the group, the number or the unit is invalid.
    """
    unit = group_named(name).width_unit
    match = _WIDTH.fullmatch(text.strip())
    if match is None:
        raise InputError(
            f"prior of {name}: expected a width such as {format_width(name, 1.0)!r} or flat, "
            f"found {text!r}"
        )
    if match["flat"]:
        width = math.inf
    else:
        width = float(match["number"]) * unit_factor(f"prior of {name}", match["unit"], unit)
        if math.isinf(width):
            raise InputError(f"prior of {name}: expected a finite width or 'flat', found {text!r}")
    check_width(name, width)
    return width


def format_width(name: str, width: float) -> str:
    """Return a prior width as a text that `parse_width` reads."""
    unit = BY_NAME[name].width_unit
    return "flat" if math.isinf(width) else f"{shortest(width)} {unit}".strip()


def parse_shift(text: str) -> tuple[str, float]:
    """Return the name of a prior, "GROUP" or "GROUP[ELEMENT]", and the shift of its centre.

    Parameters
    ----------
    text : "GROUP=SHIFT" or "GROUP[ELEMENT]=SHIFT", such as "detector_x[2]=-5um"

    Raises
    ------
    InputError
        If the group, the number or the unit is invalid.
    """
    name, found, value = text.partition("=")
    match = _SHIFT.fullmatch(value.strip())
    if not found or match is None:
        raise InputError(
            "centre of a prior: expected GROUP=SHIFT or GROUP[ELEMENT]=SHIFT, such as "
            f"detector_x[2]=-5um, found {text!r}"
        )
    group, element = split_name(name)
    name = group.name if element is None else f"{group.name}[{element}]"
    shift = float(match["number"]) * unit_factor(f"centre of {name}", match["unit"], group.unit)
    check_shift(name, shift)
    return name, shift


def format_shift(name: str, shift: float) -> str:
    """Return a shift as a text that `parse_shift` reads."""
    sign = "" if shift < 0 else "+"
    return f"{name}={sign}{shortest(shift)}{split_name(name)[0].unit}"
