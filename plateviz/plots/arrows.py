"""Vectors drawn to a stated scale: shafts, heads, and a key arrow.

Segments are used, because `hv.VectorField` normalises lengths by default.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.style import TICK_SIZE, drawn
from plateviz.plots.theme import theme_of

# Length of the root-mean-square arrow as a share of the frame's width.
_RMS_SHARE = 0.04
_HEAD_SHARE = 0.32
_LARGEST_HEAD = 0.018
_HEAD_ANGLE = math.radians(26.0)
_KEY_STRIP = 0.11
_STEPS = (1.0, 2.0, 5.0, 10.0)


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
    table: pd.DataFrame,
    *,
    scale: float,
    field: Field,
    colour: str,
    hover: Sequence[tuple[str, str]],
    extra: list[str],
) -> list[hv.Element]:
    """Return the vectors as strokes, and their tails as points with hover text.

    Parameters
    ----------
    table : tails `x`, `y` and vectors `u`, `v` in the units of the axes, columns `extra`
    scale : drawn length over true length
    field : the area drawn on; limits the size of the heads
    colour : of the arrows
    hover : label and format of each line of the hover
    extra : columns that the hover needs

    Returns
    -------
    Segments (the shafts, a row per row of `table`, then two rows for each head), points
    """
    ends = table.assign(
        x_end=table["x"] + scale * table["u"], y_end=table["y"] + scale * table["v"]
    )
    tails = hv.Points(table, ["x", "y"], extra, label="tails")
    return [
        drawn(_strokes(ends, field, "arrows"), color=colour, line_width=1.2),
        drawn(
            tails,
            color=colour,
            size=3.5,
            alpha=0.6,
            nonselection_alpha=0.15,
            tools=["hover"],
            hover_tooltips=list(hover),
        ),
    ]


def key(length: float, text: str, *, scale: float, field: Field, theme: str) -> list[hv.Element]:
    """Return a key arrow of true length `length`, with text beside it.

    Parameters
    ----------
    length : in the units of the axes, before magnification
    text : the length with its unit
    scale : drawn length over true length, the same as of the other arrows
    field : the area drawn on; the key is in the strip below it
    theme : "light" or "dark"
    """
    colours = theme_of(theme)
    direction = math.copysign(1.0, field.x[1] - field.x[0])
    x = field.x[0] + direction * 0.03 * field.width
    y = field.y[0] - 0.5 * _KEY_STRIP * field.width
    arrow = pd.DataFrame(
        {"x": [x], "y": [y], "x_end": [x + direction * scale * length], "y_end": [y]}
    )
    label = hv.Text(x + direction * (scale * length + 0.015 * field.width), y, text, halign="left")
    return [
        drawn(_strokes(arrow, field, "key"), color=colours.text, line_width=2),
        drawn(label, text_color=colours.text, text_font_size=TICK_SIZE),
    ]


def _strokes(ends: pd.DataFrame, field: Field, label: str) -> hv.Segments:
    # Shafts and heads are one element, because drawing time grows with the number of elements.
    x, y, tip_x, tip_y = (
        ends[column].to_numpy(dtype=float) for column in ("x", "y", "x_end", "y_end")
    )
    length = np.hypot(tip_x - x, tip_y - y)
    length = np.minimum(_HEAD_SHARE * length, _LARGEST_HEAD * field.width)[:, None]
    angle = np.arctan2(tip_y - y, tip_x - x)[:, None] + np.pi + np.array([-1, 1]) * _HEAD_ANGLE
    heads = (
        np.repeat(tip_x, 2),
        np.repeat(tip_y, 2),
        (tip_x[:, None] + length * np.cos(angle)).ravel(),
        (tip_y[:, None] + length * np.sin(angle)).ravel(),
    )
    columns = map(np.concatenate, zip((x, y, tip_x, tip_y), heads, strict=True))
    return hv.Segments(tuple(columns), ["x", "y", "x_end", "y_end"], label=label)
