"""What the weak modes would do on the sky, a map of arrows for each."""

import textwrap

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.arrows import Field, arrows, automatic_scale, key, rms_length, round_125
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.style import AxisLabels, framed, message, side_by_side
from plateviz.plots.theme import theme_of
from plateviz.plots.units import angle_text
from plateviz.tables.eigenmodes import eigenmode_shifts
from plateviz.tables.residuals import binned_vectors

_LABELS: AxisLabels = {
    "xlabel": "Δα cos δ (arcmin, East to the left)",
    "ylabel": "Δδ (arcmin)",
}
_HOVER = [
    ("shift in α cos δ", "@{shift_ra_mas}{0.0000} mas"),
    ("shift in δ", "@{shift_dec_mas}{0.0000} mas"),
]
_MEAN = ("sources in the bin", "@{n}")
_MAPS, _COLUMNS, _WIDTH = 9, 3, 270
_ARROWS_OF_A_MAP, _BINS = 200, 12
_LEAST_SHARE = 0.2
_MARGIN = 1.2
_KEY_SHARE = 0.08
_MAS_PER_ARCMIN = 60_000.0
# Screen pixels per character of the subtitle's font.
_PER_CHARACTER = 5.3
# A line of white space alone would be dropped; this has no width and is none.
_BLANK = "\u200b"


def plot_eigenmode_shifts(
    table: pd.DataFrame, *, theme: str = "light", width: int = _WIDTH
) -> hv.Layout | hv.Overlay:
    """Draw the shifts of the sources by each mode to a stated scale, a panel per mode.

    Above 200 sources the mean shift of each bin is drawn.

    Parameters
    ----------
    table : `tables.eigenmode_shifts`
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        title = "What the weak modes would do on the sky"
        return message(title, "No weak modes", theme=theme, width=width, **_LABELS)
    names = _even_lines(table.drop_duplicates("mode").set_index("mode")["name"], width)
    half = _MARGIN * float(np.abs(table[["x", "y"]].to_numpy()).max())
    field = Field((half, -half), (-half, half))
    # One scale for all, so that their lengths compare.
    scale = automatic_scale(table, field)
    panels = [
        _panel(rows, f"Mode {mode}", names[mode], scale, field, theme, width)
        for mode, rows in table.groupby("mode")
    ]
    return side_by_side(panels, columns=_COLUMNS)


def _panel(
    rows: pd.DataFrame, title: str, name: str, scale: float, field: Field, theme: str, width: int
) -> hv.Overlay:
    shown = rows
    if len(rows) > _ARROWS_OF_A_MAP:
        shown = binned_vectors(
            rows, x_range=field.y, y_range=field.y, bins=_BINS, least_share=_LEAST_SHARE
        )
    length = round_125(_KEY_SHARE * field.width / scale * _MAS_PER_ARCMIN)
    words = angle_text(length)
    return framed(
        [
            *arrows(
                shown,
                scale=scale,
                field=field,
                colour=theme_of(theme).mark,
                hover=[("source", "@{id}"), *_HOVER] if "id" in shown else [_MEAN, *_HOVER],
                extra=[c for c in ("id", "n", "shift_ra_mas", "shift_dec_mas") if c in shown],
            ),
            *key(length / _MAS_PER_ARCMIN, words, scale=scale, field=field, theme=theme),
        ],
        title=f"{title}: shifts of {angle_text(rms_length(rows) * _MAS_PER_ARCMIN)} rms",
        subtitle=f"Drawn {scale:,.0f} times enlarged\n{name}",
        theme=theme,
        width=width,
        xlim=field.x,
        ylim=field.ylim,
        **_LABELS,
    )


def _even_lines(names: pd.Series, width: int) -> pd.Series:
    """Return the names in as many lines each: panels of unequal height are clipped."""
    lines = names.map(lambda name: textwrap.wrap(name, int(width / _PER_CHARACTER)))
    most = max(map(len, lines))
    return lines.map(lambda parts: "\n".join([*parts, *[_BLANK] * (most - len(parts))]))


def _draw(chosen: Chosen, theme: str) -> hv.Layout | hv.Overlay:
    return plot_eigenmode_shifts(eigenmode_shifts(chosen.result, most=_MAPS), theme=theme)


DIAGNOSTICS = (
    Diagnostic(
        "eigenmode-shifts",
        "What the weak modes would do on the sky",
        "How all sources together move with one sigma of a weak mode, for up to nine that shift "
        "them most. Such common shifts, rolls and stretches do not fall with more measurements, "
        "only with better or more reference sources.",
        85,
        _draw,
        is_wide=True,
    ),
)
