"""Prior share of each calibration parameter."""

import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, Glyphs, framed, message
from plateviz.figures.glyphs import points, rectangles, texts, vertical
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.units import power_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.prior_shares import prior_shares

_TITLE = "Prior share of the calibration, by group"
_XLABEL = "prior share (0 is measured, 1 is assumed)"
_YLABEL = "parameter group (all its elements)"
_HOVER = [
    ("parameter", "@{group}, @{label}"),
    ("prior share", "@{share_text}"),
    ("value", "@{value}{0.000000} @{value_unit}"),
    ("σ marginal", "@{sigma_marginal}{0.000000} @{unit}"),
    ("σ of the prior", "@{prior_sigma}{0.000} @{unit}"),
]
_ROW_HEIGHT = 30
# Shares below would be zero with two decimals.
_LEAST = 0.005
_TICKS = [(share, f"{share:g}") for share in (0.0, 0.25, 0.5, 0.75, 1.0)]


def plot_prior_shares(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the prior share of every calibration parameter, a row per group.

    Parameters
    ----------
    table : `tables.prior_shares`
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No calibration", width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    groups = table.drop_duplicates("row")
    shown = table.assign(share_text=[_text(share) for share in table["prior_share"]])
    shares = points(
        shown,
        "prior_share",
        "height",
        name="shares",
        color="mark",
        alpha=0.75,
        # No outlines: those of overlapping points would be darker than the points.
        line_width=0.0,
        hover=_HOVER,
    )
    ticks = [(float(row), name) for row, name in zip(groups["row"], groups["group"], strict=True)]
    return framed(
        [vertical(0.5, name="half"), shares, *_largest(table)],
        title=_TITLE,
        subtitle=f"{len(table)} parameters, {int((table['prior_share'] > 0.5).sum())} of them "
        "more prior than measured; right: largest share of each group",
        x=Axis(_XLABEL, (-0.03, 1.18), ticks=_TICKS),
        y=Axis(_YLABEL, (len(groups) - 0.45, -0.55), ticks=ticks),
        width=width,
        height=_ROW_HEIGHT * len(groups) + 8,
    )


def _largest(table: pd.DataFrame) -> list[Glyphs]:
    """Return the largest share of each group as a separate column without grid lines."""
    rows = table.groupby("row")
    largest, is_flat = rows["prior_share"].max(), rows["prior_sigma"].min() == float("inf")
    words = ["flat" if is_flat[row] else _rounded(share) for row, share in largest.items()]
    ground = {"left": [1.02], "right": [1.18], "bottom": [-0.55], "top": [len(largest) - 0.45]}
    x, y = [1.165] * len(largest), largest.index.to_numpy(dtype=float)
    return [
        rectangles(ground, name="ground of largest", color="background"),
        texts(x, y, words, name="largest", align="right"),
    ]


def _text(share: float) -> str:
    return f"{share:.2f}" if share >= _LEAST or share == 0.0 else power_text(share, 1)


def _rounded(share: float) -> str:
    return "< 0.01" if 0.0 < share < _LEAST else f"{share:.2f}"


def _plot(chosen: Chosen) -> Figure:
    return plot_prior_shares(prior_shares(chosen.result))


DIAGNOSTICS = (
    Diagnostic(
        "prior-shares",
        "Prior share of the calibration",
        "The marginal variance of each parameter over its prior variance. Good: near 0, which "
        "is measured; near 1 is assumed. A share of a quarter in each of four detectors means "
        "that their common part is assumed.",
        OrbitWorkspace.CALIBRATION,
        81,
        _plot,
        least_height=320,
        equation="share = σ²(marginal) / σ²(prior)",
    ),
)
