"""Pull and influence of each reference source, by a fit without its catalogue position."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, By, Figure, Glyphs, framed, message
from plateviz.figures.glyphs import points, texts, vertical
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.style import CLASS_COLOURS
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.reference_influence import reference_influence
from plateviz.tables.sources import REFERENCE
from solver.data.plural import plural

_TITLE = "Reference sources against the fit without them"
_XLABEL, _YLABEL = "pull of the catalogue position (σ)", "shift by the catalogue position (σ)"
_HOVER = [
    ("source", "@{id}"),
    ("measurements", "@{n_obs}"),
    ("catalogue − rest, α cos δ", "@{residual_ra}{0.000} mas = @{pull_ra}{0.00} σ"),
    ("catalogue − rest, δ", "@{residual_dec}{0.000} mas = @{pull_dec}{0.00} σ"),
    ("pull", "@{pull}{0.00} σ"),
    ("shift of the estimate", "@{shift_mas}{0.000} mas = @{influence}{0.00} σ"),
    ("share of the catalogue", "@{share}{0.000}"),
]
_STRENGTH = {"expected": 0.45, "beyond": 1.0}
_SIZES = {"expected": 6.0, "beyond": 10.0}


def plot_reference_influence(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the influence of each reference source on its estimate against its pull.

    Parameters
    ----------
    table : `tables.reference_influence`
    width : of the frame, screen pixels
    """
    rows = table[table["pull"].notna()] if len(table) else table
    if rows.empty:
        text = "No reference source is measured well enough" if len(table) else "No references"
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    level = float(rows["level"].iloc[0])
    right = 1.08 * max(level, float(rows["pull"].max()))
    top = 1.08 * float(rows["influence"].max()) or 1.0
    return framed(
        [
            vertical(level, name="level"),
            texts(
                [level],
                [0.98 * top],
                ["1 % by chance "],
                name="level text",
                align="right",
                baseline="top",
            ),
            _points(rows),
        ],
        title=_TITLE,
        subtitle=_subtitle(table, rows),
        x=Axis(_XLABEL, (0.0, right)),
        y=Axis(_YLABEL, (0.0, top)),
        width=width,
        height=round(0.62 * width),
    )


def _points(rows: pd.DataFrame) -> Glyphs:
    strength = np.where(rows["is_beyond"], "beyond", "expected").astype(object)
    return points(
        rows.assign(strength=strength),
        "pull",
        "influence",
        name="sources",
        color=CLASS_COLOURS[REFERENCE],
        marker="x",
        size=By("strength", _SIZES),
        line_width=1.4,
        alpha=By("strength", _STRENGTH),
        hover=_HOVER,
        keep=["id"],
    )


def _subtitle(table: pd.DataFrame, rows: pd.DataFrame) -> str:
    ra, dec = (float(np.sqrt(np.mean(rows[f"pull_{axis}"] ** 2))) for axis in ("ra", "dec"))
    unknown = len(table) - len(rows)
    left_out = f"; {unknown:,} not measured well enough" if unknown else ""
    return (
        f"{len(rows):,} reference {plural(len(rows), 'source')}{left_out}; "
        f"rms pull {ra:.2f} (α), {dec:.2f} (δ), expected 1\n"
        f"{int(rows['is_beyond'].sum()):,} beyond {rows['level'].iloc[0]:.2f} σ, "
        "which the largest exceeds by chance in 1 %"
    )


def _plot(chosen: Chosen) -> Figure:
    return plot_reference_influence(reference_influence(chosen.result))


DIAGNOSTICS = (
    Diagnostic(
        "reference-influence",
        _TITLE,
        "Each reference source as if its own catalogue position were left out of the fit. The "
        "pull is the catalogue position minus the estimate without it, over the uncertainty of "
        "both. The shift is how far the catalogue position moves the estimate. Good: no pull "
        "beyond the dashed line. One beyond it on the upper right has a wrong catalogue position "
        "or wrong measurements, and its estimate depends on which of them is wrong.",
        OrbitWorkspace.SKY,
        65,
        _plot,
        equation=(
            "catalogue − rest = −P (P − C)⁻¹ o; pull² = oᵀ (P − C)⁻¹ o, with the offset "
            "o from the catalogue, its covariance P, and the marginal covariance C of "
            "the estimate"
        ),
    ),
)
