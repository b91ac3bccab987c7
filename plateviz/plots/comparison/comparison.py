"""Differences between two fits of the same sources, on the sky and over their uncertainty."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, framed, message, side_by_side
from plateviz.plots.diagnostic import TO_COMPARE, Chosen, Diagnostic
from plateviz.plots.elements.arrows import (
    Field,
    arrows,
    automatic_scale,
    key,
    rms_length,
    round_125,
)
from plateviz.plots.elements.points import steps
from plateviz.plots.elements.style import ARROW_LIMIT, SERIES_COLOURS
from plateviz.plots.elements.units import angle_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.comparison import comparison, difference_histogram
from plateviz.tables.residuals import binned_vectors
from solver.data.plural import plural
from solver.units import MAS_PER_ARCMIN

_MAP = "Difference of positions, B minus A"
_MAP_X, _MAP_Y = "Δα cos δ (arcmin, East to the left)", "Δδ (arcmin)"
_HISTOGRAM = "Difference over uncertainty"
_HISTOGRAM_X, _HISTOGRAM_Y = "(B minus A) / marginal σ of A", "sources per bin"
_NONE = "No source in both fits"
_MARGIN = 1.14
_LEAST_SHARE = 0.25
_BINS = 24
_NAMES = {"ra": "α cos δ", "dec": "δ"}
_HOVER_VALUES = [
    ("Δα cos δ", "@{difference_ra_mas}{0.00000} mas"),
    ("Δδ", "@{difference_dec_mas}{0.00000} mas"),
    ("over σ", "@{pull_ra}{0.000}, @{pull_dec}{0.000}"),
    ("σ of B / σ of A", "@{sigma_ratio_ra}{0.000}, @{sigma_ratio_dec}{0.000}"),
]


def plot_comparison(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the differences on the sky and their histogram side by side.

    Parameters
    ----------
    table : `tables.comparison`
    width : of each frame, screen pixels
    """
    panels = [
        plot_comparison_map(table, width=width),
        plot_comparison_histogram(table, width=width),
    ]
    return side_by_side(panels, columns=2)


def plot_comparison_map(
    table: pd.DataFrame, *, arrow_scale: float | None = None, width: int = FRAME_WIDTH
) -> Figure:
    """Draw the differences as arrows to a stated scale; above 2,000, their means in bins.

    Parameters
    ----------
    table : `tables.comparison`
    arrow_scale : drawn length over true length; None for a round number
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_MAP, _NONE, width=width, xlabel=_MAP_X, ylabel=_MAP_Y)
    half = _MARGIN * (float(np.abs(table[["x_arcmin", "y_arcmin"]].to_numpy()).max()) or 1.0)
    field = Field((half, -half), (-half, half))
    shown, what = _thinned(_vectors(table), half)
    scale = arrow_scale or automatic_scale(shown, field)
    field = field.holding(shown, scale)
    mas = round_125(2.0 * rms_length(shown) * MAS_PER_ARCMIN)
    length = angle_text(mas)
    single = [("source", "@{id}"), ("class", "@{source_class}")]
    hover = single if "id" in shown else [("sources in the bin", "@{n}")]
    return framed(
        [
            *arrows(
                shown,
                scale=scale,
                field=field,
                colour="mark",
                hover=[*hover, *_HOVER_VALUES],
            ),
            *key(mas / MAS_PER_ARCMIN, length, scale=scale, field=field),
        ],
        title=_MAP,
        subtitle=f"{what}\nArrows enlarged {scale:,.12g} times; key: {length}",
        x=Axis(_MAP_X, field.x),
        y=Axis(_MAP_Y, field.ylim),
        width=width,
    )


def plot_comparison_histogram(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the histogram of the differences over the marginal uncertainty of A.

    Parameters
    ----------
    table : `tables.comparison`
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_HISTOGRAM, _NONE, width=width, xlabel=_HISTOGRAM_X, ylabel=_HISTOGRAM_Y)
    histogram = difference_histogram(table)
    limit = float(histogram["right"].max())
    ratios = table[["sigma_ratio_ra", "sigma_ratio_dec"]].median()
    return framed(
        [
            steps(rows, _NAMES[str(coordinate)], SERIES_COLOURS[number])
            for number, (coordinate, rows) in enumerate(histogram.groupby("coordinate", sort=False))
        ],
        title=_HISTOGRAM,
        subtitle=f"{len(table):,} {plural(len(table), 'source')}\nmedian σ of B over σ of A: "
        f"{ratios.iloc[0]:.3f} (α), {ratios.iloc[1]:.3f} (δ)",
        x=Axis(_HISTOGRAM_X, (-limit, limit)),
        y=Axis(_HISTOGRAM_Y, (0.0, 1.1 * float(histogram["count"].max()))),
        width=width,
        height=round(0.75 * width),
        legend_columns=2,
    )


def _vectors(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(
        x=table["x_arcmin"],
        y=table["y_arcmin"],
        u=table["u_arcmin"],
        v=table["v_arcmin"],
    )


def _thinned(vectors: pd.DataFrame, half: float) -> tuple[pd.DataFrame, str]:
    sources = f"{len(vectors):,} {plural(len(vectors), 'source')}"
    if len(vectors) <= ARROW_LIMIT:
        return vectors, f"{sources}, one arrow each"
    means = binned_vectors(
        vectors, x_range=(-half, half), y_range=(-half, half), bins=_BINS, least_share=_LEAST_SHARE
    )
    return means, (
        f"{sources}: mean difference in {len(means):,} {plural(len(means), 'bin')} of a "
        f"{_BINS} × {_BINS} grid"
    )


def _plot(chosen: Chosen) -> Figure:
    if chosen.other is None:
        return message(_MAP, f"How far each source moves from (A) to (B). {TO_COMPARE}")
    return plot_comparison(comparison(chosen.other, chosen.result))


DIAGNOSTICS = (
    Diagnostic(
        "comparison",
        "Comparison of two solutions",
        "The current solution (B) minus the previous one (A): positions on the sky, and the "
        "differences over their uncertainty. Good: differences well below the uncertainty, so "
        "that the change of settings does not matter.",
        OrbitWorkspace.ORDERS,
        86,
        _plot,
        is_wide=True,
        has_data=lambda chosen: chosen.other is not None,
        equation="Δ = B − A; Δ / σ, with the marginal σ of A",
    ),
)
