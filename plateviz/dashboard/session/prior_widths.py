"""Prior widths as the texts of their controls: short, and read back without a loss."""

import re
from collections.abc import Mapping
from functools import cache

from solver.data.parameter_group import Group
from solver.data.parameters import BY_NAME, PARAMETERS
from solver.data.prior_text import format_width, parse_width
from solver.data.quantity_text import QUANTITY
from solver.data.settings import FitSettings


def default_widths() -> dict[str, str]:
    """Return the texts of the paper's prior widths."""
    return dict(_default_widths())


@cache
def _default_widths() -> dict[str, str]:
    return {group.name: _short(group.name, group.width) for group in PARAMETERS}


def width_texts(settings: FitSettings) -> dict[str, str]:
    """Return a text for each group, with six digits where these tell it from the paper's width."""
    found = default_widths()
    for name, width in settings.prior_widths.items():
        short, is_default = _short(name, width), width == BY_NAME[name].width
        found[name] = (
            format_width(name, width) if short == found[name] and not is_default else short
        )
    return found


def completed_width(group: Group, text: str) -> str:
    """Return a text as a person means it: the paper's width if it is empty, and with a unit."""
    text = text.strip()
    if not text:
        return default_widths()[group.name]
    is_number = re.fullmatch(QUANTITY, text) and text[-1].isdigit()
    return f"{text} {group.width_unit}".strip() if is_number else text


def widths_of(texts: Mapping[str, str], shown: FitSettings) -> dict[str, float]:
    """Return the prior widths that differ from the paper's.

    Parameters
    ----------
    texts : by group, as a person left them
    shown : settings whose `width_texts` were shown; a text that is still the same stands for the
        whole number

    Raises
    ------
    InputError
        If a text is no width.
    """
    before, default = width_texts(shown), default_widths()
    return {
        name: shown.width(name) if text.strip() == before[name] else parse_width(name, text)
        for name, text in texts.items()
        if text.strip() != default[name]
    }


def _short(name: str, width: float) -> str:
    return format_width(name, float(f"{width:.6g}"))
