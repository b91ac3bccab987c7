"""Vectors drawn to a stated scale: shafts, heads, and a key arrow."""

import math
from dataclasses import replace
from typing import NamedTuple, Self

import numpy as np
import pandas as pd

from plateviz.figures.figure import Glyphs, Look, Tooltips
from plateviz.figures.glyphs import points, segments, texts

# Length of the root-mean-square arrow as a share of the frame's width.
_RMS_SHARE = 0.04
_HEAD_SHARE = 0.32
_LARGEST_HEAD = 0.018
_HEAD_ANGLE = math.radians(26.0)
_KEY_STRIP = 0.11
_STEPS = (1.0, 2.0, 5.0, 10.0)
# Of an arrow: the shaft and both strokes of the head.
_ROWS = 3
# Columns by which an arrow is selected.
_KEYS = ("id", "exposure", "detector_id")


class Field(NamedTuple):
    """The area in which vectors are drawn, in the units of the axes.

    Attributes
    ----------
    x, y : limits of the data; the first may be the larger, for a reversed axis
    """

    x: tuple[float, float]
    y: tuple[float, float]

    @property
    def width(self) -> float:
        """Width of the area, positive."""
        return abs(self.x[1] - self.x[0])

    @property
    def ylim(self) -> tuple[float, float]:
        """Limits of the y axis: those of the data, and a strip below for the key."""
        return self.y[0] - _KEY_STRIP * self.width, self.y[1]

    def holding(self, table: pd.DataFrame, scale: float) -> Self:
        """Return the area, enlarged about its middle until it holds all arrows with their heads.

        Parameters
        ----------
        table, scale : as in `arrows`
        """
        if table.empty:
            return self
        grown = 1.0
        for limits, at, vector in ((self.x, "x", "u"), (self.y, "y", "v")):
            middle, half = 0.5 * (limits[0] + limits[1]), 0.5 * abs(limits[1] - limits[0])
            reach = np.abs(table[at] + scale * table[vector] - middle).max()
            # A head is wider than its shaft.
            grown = max(grown, float(reach) / half * (1.0 + _LARGEST_HEAD))
        return type(self)(_about_middle(self.x, grown), _about_middle(self.y, grown))


def round_125(value: float) -> float:
    """Return the number 1, 2 or 5 times a power of ten that is nearest to `value` in log scale."""
    if not (math.isfinite(value) and value > 0):
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    step = min(_STEPS, key=lambda s: abs(math.log(value / (s * power))))
    # The round trip through text makes 5 * 10**-3 the number that prints as 0.005.
    return float(f"{step * power:.12g}")


def rms_length(table: pd.DataFrame) -> float:
    """Return the root-mean-square length of the vectors `u`, `v`; 0 for none."""
    if table.empty:
        return 0.0
    return float(np.sqrt(np.mean(table["u"].to_numpy() ** 2 + table["v"].to_numpy() ** 2)))


def automatic_scale(table: pd.DataFrame, field: Field) -> float:
    """Return the round magnification that makes the rms arrow about 4 % of the width."""
    rms = rms_length(table)
    return round_125(_RMS_SHARE * field.width / rms) if rms > 0 else 1.0


def arrows(
    table: pd.DataFrame, *, scale: float, field: Field, colour: Look, hover: Tooltips
) -> list[Glyphs]:
    """Return the vectors as strokes, and their tails as points with hover text.

    Parameters
    ----------
    table : tails `x`, `y` and vectors `u`, `v` in the units of the axes, columns of the hover,
        and `id`, `exposure` and `detector_id` where an arrow is of one of them
    scale : drawn length over true length
    field : the area drawn on; limits the size of the heads
    colour : of the arrows
    hover : label and format of each line of the hover

    Returns
    -------
    Segments "arrows" (the shafts, a row per row of `table`, then two rows for each head), and
    points "tails"
    """
    x, y = (table[name].to_numpy(dtype=float) for name in "xy")
    u, v = (scale * table[name].to_numpy(dtype=float) for name in "uv")
    strokes = _strokes(x, y, x + u, y + v, field)
    # An arrow is selected with its tail.
    kept = {name: table[name].to_numpy(dtype=object) for name in _KEYS if name in table}
    of_strokes = {name: np.concatenate([ids, np.repeat(ids, 2)]) for name, ids in kept.items()}
    tails = points(
        table, "x", "y", name="tails", color=colour, size=3.5, alpha=0.6, hover=hover, keep=[*kept]
    )
    shafts = segments(*strokes, name="arrows", color=colour, keep=of_strokes)
    return [replace(shafts, arrow_rows=_ROWS), tails]


def key(length: float, text: str, *, scale: float, field: Field) -> list[Glyphs]:
    """Return a key arrow of true length `length`, with text beside it.

    Parameters
    ----------
    length : in the units of the axes, before magnification
    text : the length with its unit
    scale : drawn length over true length, the same as of the other arrows
    field : the area drawn on; the key is in the strip below it
    """
    direction = math.copysign(1.0, field.x[1] - field.x[0])
    x = field.x[0] + direction * 0.03 * field.width
    y = field.y[0] - 0.5 * _KEY_STRIP * field.width
    tip = x + direction * scale * length
    tail_x, at_y, tip_x = (np.array([value]) for value in (x, y, tip))
    strokes = _strokes(tail_x, at_y, tip_x, at_y, field)
    return [
        replace(segments(*strokes, name="key", color="text", width=2.0), arrow_rows=_ROWS),
        texts([tip + direction * 0.015 * field.width], [y], [text], name="key text", align="left"),
    ]


def _about_middle(limits: tuple[float, float], factor: float) -> tuple[float, float]:
    middle = 0.5 * (limits[0] + limits[1])
    return middle + factor * (limits[0] - middle), middle + factor * (limits[1] - middle)


def _strokes(
    x: np.ndarray, y: np.ndarray, tip_x: np.ndarray, tip_y: np.ndarray, field: Field
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the ends of shafts and heads, which are one glyph table."""
    length = np.hypot(tip_x - x, tip_y - y)
    length = np.minimum(_HEAD_SHARE * length, _LARGEST_HEAD * field.width)[:, None]
    angle = np.arctan2(tip_y - y, tip_x - x)[:, None] + np.pi + np.array([-1, 1]) * _HEAD_ANGLE
    return (
        np.concatenate([x, np.repeat(tip_x, 2)]),
        np.concatenate([y, np.repeat(tip_y, 2)]),
        np.concatenate([tip_x, (tip_x[:, None] + length * np.cos(angle)).ravel()]),
        np.concatenate([tip_y, (tip_y[:, None] + length * np.sin(angle)).ravel()]),
    )
