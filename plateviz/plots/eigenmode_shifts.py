"""Shifts of the sources along the weak directions, a map of arrows for each direction."""

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

_TITLE = "What the weak directions do on the sky"
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
# A zero-width space: Bokeh drops lines of ordinary white space.
_BLANK = "\u200b"


def plot_eigenmode_shifts(
    table: pd.DataFrame, *, theme: str = "light", width: int = _WIDTH
) -> hv.Layout | hv.Overlay:
    """Draw the shifts of the sources along each weak direction to a stated scale, a panel each.

    Above 200 sources the mean shift of each bin is drawn.

    Parameters
    ----------
    table : `tables.eigenmode_shifts`
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No weak directions", theme=theme, width=width, **_LABELS)
    names = _even_lines(table.drop_duplicates("mode").set_index("mode")["name"], width)
    half = _MARGIN * float(np.abs(table[["x", "y"]].to_numpy()).max())
    field = Field((half, -half), (-half, half))
    # One scale for all panels, so that lengths can be compared.
    scale = automatic_scale(table, field)
    panels = [
        _panel(rows, f"Direction {mode}", names[mode], scale, field, theme, width)
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
    length_text = angle_text(length)
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
            *key(length / _MAS_PER_ARCMIN, length_text, scale=scale, field=field, theme=theme),
        ],
        title=f"{title}: shifts of {angle_text(rms_length(rows) * _MAS_PER_ARCMIN)} rms",
        subtitle=f"Arrows enlarged {scale:,.0f} times\n{name}",
        theme=theme,
        width=width,
        xlim=field.x,
        ylim=field.ylim,
        **_LABELS,
    )


def _even_lines(names: pd.Series, width: int) -> pd.Series:
    """Return the names with equal numbers of lines, because unequal panels are clipped."""
    lines = names.map(lambda name: textwrap.wrap(name, int(width / _PER_CHARACTER)))
    most = max(map(len, lines))
    return lines.map(lambda parts: "\n".join([*parts, *[_BLANK] * (most - len(parts))]))


def _draw(chosen: Chosen, theme: str) -> hv.Layout | hv.Overlay:
    return plot_eigenmode_shifts(eigenmode_shifts(chosen.result, most=_MAPS), theme=theme)


DIAGNOSTICS = (
    Diagnostic(
        "eigenmode-shifts",
        _TITLE,
        "How all sources move together per sigma along a weak direction, for the up to nine "
        "directions that shift them most. More measurements do not reduce such common shifts, "
        "rolls and stretches; only more or better reference sources do.",
        85,
        _draw,
        is_wide=True,
    ),
)
