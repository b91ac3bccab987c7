"""How far each parameter group moves along the weak directions of the calibration."""

import math

import numpy as np
import pandas as pd

from plateviz.figures.figure import Axis, Figure, Glyphs, Ramp, framed, message
from plateviz.figures.glyphs import rectangles, texts
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.units import angle_text, finer_unit
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.eigenmodes import eigenmode_groups

_PAGE_WIDTH = 860
_TITLE = "Which parameters the weak directions move"
_XLABEL = "parameter group (rms move per σ along the direction)"
_YLABEL = "weak direction (number)"
_CELL_HOVER = [
    ("weak direction", "@{mode} @{name}"),
    ("group", "@{group}"),
    ("share", "@{share}{0.0000}"),
    ("rms move per σ", "@{move_text}"),
]
_SMALL = "10px"
# Cells with a smaller share have no text.
_LEAST_LABELLED_SHARE = 0.005
# Where the shift of the sources stands, in cells beyond those of the groups: it has no cell that
# it has to fit.
_SHIFT_AT = 0.35


def plot_eigenmode_groups(table: pd.DataFrame, *, width: int = _PAGE_WIDTH) -> Figure:
    """Draw the share of each parameter group in each weak direction, with its rms move.

    Parameters
    ----------
    table : `tables.eigenmode_groups`
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No weak directions", width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    groups, modes = list(table["group"].unique()), table["mode"].unique()
    moves = [_amount(move, unit) for move, unit in zip(table["move"], table["unit"], strict=True)]
    cells = table.assign(column=table["group"].map(groups.index), move_text=moves)
    columns = [(float(i), name) for i, name in enumerate(groups)]
    columns.append((len(groups) + _SHIFT_AT, "shift of sources"))
    rows = [(float(mode), str(mode)) for mode in modes]
    return framed(
        [_cells(cells), *_cell_labels(cells), *_shifts(cells, len(groups))],
        title=_TITLE,
        subtitle="Upper number: the group's share of squared moves over conditional sigmas; lower "
        "number: the rms move of its elements per sigma along the direction",
        x=Axis(_XLABEL, (-0.5, len(groups) + 2.0 * _SHIFT_AT + 0.5), ticks=columns, rotation=30.0),
        y=Axis(_YLABEL, (int(modes.max()) + 0.5, 0.5), ticks=rows),
        width=width,
        height=32 * len(modes) + 8,
    )


def _cells(cells: pd.DataFrame) -> Glyphs:
    return rectangles(
        cells.assign(
            left=cells["column"] - 0.48,
            right=cells["column"] + 0.48,
            bottom=cells["mode"] - 0.46,
            top=cells["mode"] + 0.46,
        ),
        name="cells",
        color=Ramp("share", "share", (0.0, 1.0), label="share (0 to 1)"),
        line_color="grid",
        hover=_CELL_HOVER,
    )


def _cell_labels(cells: pd.DataFrame) -> list[Glyphs]:
    rows = cells[cells["share"] >= _LEAST_LABELLED_SHARE]
    shares = [f"{share:.2f}" for share in rows["share"]]
    x, y = rows["column"], rows["mode"]
    return [
        texts(x, y - 0.2, shares, name="shares", size=_SMALL),
        texts(x, y + 0.2, rows["move_text"], name="moves", size=_SMALL),
    ]


def _shifts(cells: pd.DataFrame, column: int) -> list[Glyphs]:
    """Return the shift of the sources as a separate column without grid lines."""
    modes = cells.drop_duplicates("mode")
    ground = {
        "left": [column - 0.48],
        "right": [column + 2.0 * _SHIFT_AT + 0.5],
        "bottom": [float(modes["mode"].min()) - 0.5],
        "top": [float(modes["mode"].max()) + 0.5],
    }
    shifts = [angle_text(shift) for shift in modes["shift_mas"]]
    return [
        rectangles(ground, name="ground of shifts", color="background"),
        texts(np.full(len(modes), column + _SHIFT_AT), modes["mode"], shifts, name="shifts"),
    ]


def _amount(move: float, unit: str) -> str:
    """Return a move to two digits in a suitable unit."""
    if move <= 0.0:
        return f"0 {unit}"
    finer, factor = finer_unit(move, unit)
    value = move * factor
    decimals = max(0, 1 - math.floor(math.log10(value)))
    return f"{value:,.{decimals}f} {finer}"


def _plot_groups(chosen: Chosen) -> Figure:
    return plot_eigenmode_groups(eigenmode_groups(chosen.result))


DIAGNOSTICS = (
    Diagnostic(
        "eigenmode-groups",
        "Which parameters the weak directions move",
        "How far one sigma along each weak direction moves each parameter group, and the sources "
        "with it. A direction that moves parameters far but does not shift the sources is "
        "harmless.",
        OrbitWorkspace.WEAK_DIRECTIONS,
        84,
        _plot_groups,
        is_wide=True,
        needs_eigenmodes=True,
        least_height=450,
        equation=(
            "move = v with vᵀ S v = 1, one sigma long; share = Σ (v / σ(conditional))² "
            "of the group over that of all groups"
        ),
    ),
)
