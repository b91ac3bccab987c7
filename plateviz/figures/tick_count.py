"""Number of ticks for which the axes of a frame have room."""

import math

from plateviz.figures.figure import Axis
from plateviz.figures.text_width import text_width
from plateviz.figures.theme import SMALL_SIZE
from plateviz.figures.tick_numbers import has_groups

_LEAST, _MOST = 2, 6
# Screen pixels between two labels beside each other, and for a label above another.
_GAP, _ROW = 5, 20
_TYPICAL = 4


def columns_of_ticks(axis: Axis, width: int) -> int:
    """Return how many labels of a linear lower axis have room beside each other.

    Parameters
    ----------
    width : of the frame, screen pixels
    """
    label = longest_label(axis)
    return _limited(width / (text_width(label, SMALL_SIZE) + _GAP))


def rows_of_ticks(height: int) -> int:
    """Return how many labels of a left axis have room, in a frame of a height in screen pixels."""
    return _limited(height / _ROW)


def longest_label(axis: Axis) -> str:
    """Return a label as long as the longest one of an axis with automatic ticks."""
    step = axis.length / _TYPICAL
    decimals = max(0, -math.floor(math.log10(step))) if step > 0 else 0
    sign = "−" if min(axis.limits) < 0 else ""
    comma = "," if axis.is_grouped and has_groups(axis.limits) else ""
    most = max(map(abs, axis.limits))
    return f"{sign}{most:{comma}.{decimals}f}"


def _limited(number: float) -> int:
    return min(_MOST, max(_LEAST, math.ceil(number)))
