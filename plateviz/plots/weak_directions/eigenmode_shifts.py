"""Shifts of the sources along the weak directions, a map of arrows for each direction."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import Axis, Figure, framed, message, side_by_side
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.arrows import (
    Field,
    arrows,
    automatic_scale,
    key,
    rms_length,
    round_125,
)
from plateviz.plots.elements.units import angle_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.eigenmodes import eigenmode_shifts
from plateviz.tables.residuals import binned_vectors
from solver.units import MAS_PER_ARCMIN

_TITLE = "What the weak directions do on the sky"
_XLABEL, _YLABEL = "Δα cos δ (arcmin, East to the left)", "Δδ (arcmin)"
_HOVER = [
    ("shift in α cos δ", "@{shift_ra_mas}{0.0000} mas"),
    ("shift in δ", "@{shift_dec_mas}{0.0000} mas"),
]
_MEAN = ("sources in the bin", "@{n}")
# More maps than these are too small to be read on a page.
_MAPS, _COLUMNS, _WIDTH = 6, 3, 270
_ARROWS_OF_A_MAP, _BINS = 200, 12
_LEAST_SHARE = 0.2
_MARGIN = 1.2
_KEY_SHARE = 0.08


def plot_eigenmode_shifts(table: pd.DataFrame, *, width: int = _WIDTH) -> Figure:
    """Draw the shifts of the sources along each weak direction to a stated scale, a panel each.

    Above 200 sources the mean shift of each bin is drawn.

    Parameters
    ----------
    table : `tables.eigenmode_shifts`
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No weak directions", width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    half = _MARGIN * float(np.abs(table[["x", "y"]].to_numpy()).max())
    field = Field((half, -half), (-half, half))
    # One scale for all panels, so that lengths can be compared.
    scale = automatic_scale(table, field)
    maps = {f"Direction {mode}": rows for mode, rows in table.groupby("mode")}
    shown = {title: _thinned(rows, field) for title, rows in maps.items()}
    for rows in shown.values():
        field = field.holding(rows, scale)
    panels = [
        _panel(rows, shown[title], title, scale, field, width) for title, rows in maps.items()
    ]
    return side_by_side(panels, columns=_COLUMNS)


def _thinned(rows: pd.DataFrame, field: Field) -> pd.DataFrame:
    """Return the shifts, or their means in bins if there are many."""
    if len(rows) <= _ARROWS_OF_A_MAP:
        return rows
    return binned_vectors(
        rows, x_range=field.y, y_range=field.y, bins=_BINS, least_share=_LEAST_SHARE
    )


def _panel(
    rows: pd.DataFrame, shown: pd.DataFrame, title: str, scale: float, field: Field, width: int
) -> Figure:
    length = round_125(_KEY_SHARE * field.width / scale * MAS_PER_ARCMIN)
    length_text = angle_text(length)
    return framed(
        [
            *arrows(
                shown,
                scale=scale,
                field=field,
                colour="mark",
                hover=[("source", "@{id}"), *_HOVER] if "id" in shown else [_MEAN, *_HOVER],
            ),
            *key(length / MAS_PER_ARCMIN, length_text, scale=scale, field=field),
        ],
        title=f"{title}: {angle_text(rms_length(rows) * MAS_PER_ARCMIN)}",
        subtitle=f"rms; arrows enlarged {scale:,.0f} times\n{rows['name'].iloc[0]}",
        x=Axis(_XLABEL, field.x),
        y=Axis(_YLABEL, field.ylim),
        width=width,
    )


def _plot(chosen: Chosen) -> Figure:
    return plot_eigenmode_shifts(eigenmode_shifts(chosen.result, most=_MAPS))


DIAGNOSTICS = (
    Diagnostic(
        "eigenmode-shifts",
        _TITLE,
        "How all sources move together per sigma along a weak direction, for the up to six "
        "directions that shift them most. More measurements do not reduce such common shifts, "
        "rolls and stretches; only more or better reference sources do.",
        OrbitWorkspace.WEAK_DIRECTIONS,
        85,
        _plot,
        is_wide=True,
        needs_eigenmodes=True,
        least_height=450,
        narrow_height=640,
        equation="shift of a source = J v, with the shift J per parameter, and vᵀ S v = 1",
    ),
)
