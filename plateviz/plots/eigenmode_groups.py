"""How far each parameter group moves along the weak directions of the calibration."""

import math

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.style import TICK_SIZE, AxisLabels, Limits, drawn, framed, message
from plateviz.plots.theme import theme_of
from plateviz.plots.units import angle_text
from plateviz.tables.eigenmodes import eigenmode_groups

_PAGE_WIDTH = 860
_TITLE = "Which parameters the weak directions move"
_LABELS: AxisLabels = {
    "xlabel": "parameter group (rms move per σ along the direction)",
    "ylabel": "weak direction (number)",
}
_CELL_HOVER = [
    ("weak direction", "@{mode} @{name}"),
    ("group", "@{group}"),
    ("share", "@{share}{0.0000}"),
    ("rms move per σ", "@{move_text}"),
]
_SMALL = "10px"
# Cells with a smaller share have no text.
_LEAST_LABELLED_SHARE = 0.005
# Units in steps of a factor of a thousand.
_UNITS = {"arcsec": ("arcsec", "mas", "µas"), "µm": ("µm", "nm", "pm")}


def plot_eigenmode_groups(
    table: pd.DataFrame, *, theme: str = "light", width: int = _PAGE_WIDTH
) -> hv.Overlay:
    """Draw the share of each parameter group in each weak direction, with its rms move.

    Parameters
    ----------
    table : `tables.eigenmode_groups`
    theme : "light" or "dark"
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No weak directions", theme=theme, width=width, **_LABELS)
    groups, modes = list(table["group"].unique()), table["mode"].unique()
    moves = [_amount(move, unit) for move, unit in zip(table["move"], table["unit"], strict=True)]
    cells = table.assign(column=table["group"].map(groups.index), move_text=moves)
    ticks = [*((i, name) for i, name in enumerate(groups)), (len(groups), "shift of sources")]
    return framed(
        [_cells(cells, theme), *_cell_labels(cells, theme), *_shifts(cells, len(groups), theme)],
        title=_TITLE,
        subtitle="Upper number: the group's share of squared moves over conditional sigmas; lower "
        "number: the rms move of its elements per sigma along the direction",
        theme=theme,
        width=width,
        height=32 * len(modes) + 8,
        xlim=(-0.5, len(groups) + 0.5),
        ylim=(int(modes.max()) + 0.5, 0.5),
        xticks=ticks,
        yticks=[(int(mode), str(mode)) for mode in modes],
        xrotation=30,
        **_LABELS,
    )


def _cells(cells: pd.DataFrame, theme: str) -> hv.Rectangles:
    rectangles = hv.Rectangles(
        cells.assign(
            left=cells["column"] - 0.48,
            right=cells["column"] + 0.48,
            bottom=cells["mode"] - 0.46,
            top=cells["mode"] + 0.46,
        ),
        ["left", "bottom", "right", "top"],
        ["share", "mode", "name", "group", "move_text"],
    )
    colours = theme_of(theme)
    return drawn(
        rectangles,
        color="share",
        cmap=colours.share_palette,
        clim=(0.0, 1.0),
        colorbar=True,
        clabel="share (0 to 1)",
        colorbar_opts={"width": 10},
        line_color=colours.grid,
        tools=["hover"],
        hover_tooltips=_CELL_HOVER,
    )


def _cell_labels(cells: pd.DataFrame, theme: str) -> list[hv.Labels]:
    rows = cells[cells["share"] >= _LEAST_LABELLED_SHARE]
    shares = [f"{share:.2f}" for share in rows["share"]]
    lines = (
        hv.Labels((rows["column"], rows["mode"] - 0.2, shares)),
        hv.Labels((rows["column"], rows["mode"] + 0.2, rows["move_text"])),
    )
    colour = theme_of(theme).text
    return [drawn(line, text_color=colour, text_font_size=_SMALL) for line in lines]


def _shifts(cells: pd.DataFrame, column: int, theme: str) -> list[hv.Element]:
    """Return the shift of the sources as a separate column without grid lines."""
    modes, colours = cells.drop_duplicates("mode"), theme_of(theme)
    rows: Limits = (float(modes["mode"].min()) - 0.5, float(modes["mode"].max()) + 0.5)
    ground = hv.Rectangles([(column - 0.48, rows[0], column + 0.5, rows[1])])
    shifts = [angle_text(shift) for shift in modes["shift_mas"]]
    text = hv.Labels((np.full(len(modes), column), modes["mode"], shifts))
    return [
        drawn(ground, color=colours.background, line_color=None),
        drawn(text, text_color=colours.text, text_font_size=TICK_SIZE),
    ]


def _amount(move: float, unit: str) -> str:
    """Return a move to two digits in a suitable unit."""
    if move <= 0.0:
        return f"0 {unit}"
    units = _UNITS.get(unit, (unit,))
    step = min(max(0, math.ceil(-math.log10(move) / 3.0 - 1e-9)), len(units) - 1)
    value = move * 1000.0**step
    decimals = max(0, 1 - math.floor(math.log10(value)))
    return f"{value:,.{decimals}f} {units[step]}"


def _draw_groups(chosen: Chosen, theme: str) -> hv.Overlay:
    return plot_eigenmode_groups(eigenmode_groups(chosen.result), theme=theme)


DIAGNOSTICS = (
    Diagnostic(
        "eigenmode-groups",
        "Which parameters the weak directions move",
        "How far one sigma along each weak direction moves each parameter group, and the sources "
        "with it. A direction that moves parameters far but does not shift the sources is "
        "harmless.",
        84,
        _draw_groups,
        is_wide=True,
    ),
)
