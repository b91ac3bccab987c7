"""Uncertainty against the number of measurements (paper, figure "uncertainty")."""

from typing import Literal

import numpy as np
import pandas as pd

from plateviz.figures.figure import (
    Axis,
    By,
    Figure,
    Glyphs,
    Limits,
    Tooltips,
    framed,
    message,
    side_by_side,
)
from plateviz.figures.glyphs import line, points, segments
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.style import CLASS_COLOURS, PANEL_WIDTH, ROW_LIMIT
from plateviz.plots.elements.ticks import log_ticks
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.sources import CLASSES, KINDS, uncertainty, uncertainty_by_count
from solver.data.plural import plural

Coordinate = Literal["ra", "dec", "both"]

_TITLE = "Uncertainty against number of measurements"
_NAMES = {"ra": "α cos δ", "dec": "δ"}
_XLABEL = "number of measurements N"
_HOVER = [
    ("source", "@{id}"),
    ("series", "@{series}"),
    ("measurements", "@{n_obs}"),
    ("σ", "@{sigma_mas}{0.0000} mas"),
]
_HOVER_MEDIAN = [
    ("series", "@{series}"),
    ("measurements", "@{n_obs}"),
    ("sources", "@{n}"),
    ("median σ", "@{sigma_mas}{0.0000} mas"),
]


def plot_uncertainty(
    table: pd.DataFrame, *, coordinate: Coordinate = "both", width: int = PANEL_WIDTH
) -> Figure:
    """Draw conditional and marginal uncertainties against N, with the square-root law.

    Above 20,000 points in a panel, the median at each N is drawn with the range from the 16th
    to the 84th percentile.

    Parameters
    ----------
    table : `tables.uncertainty`
    coordinate : "ra", "dec", or "both" for a panel each
    width : of each panel's frame, screen pixels
    """
    wanted = ("ra", "dec") if coordinate == "both" else (coordinate,)
    shown = table[(table["n_obs"] > 0) & (table["sigma_mas"] > 0)] if len(table) else table
    if shown.empty:
        return message(_TITLE, "No sources", width=width, xlabel=_XLABEL, ylabel="σ (mas)")
    limits = _limits(shown)
    panels = [_panel(shown[shown["coordinate"] == name], name, limits, width) for name in wanted]
    return side_by_side(panels, columns=2, linked="xy")


def _panel(
    rows: pd.DataFrame, coordinate: str, limits: tuple[Limits, Limits], width: int
) -> Figure:
    reduced = len(rows) > ROW_LIMIT
    drawn_rows = uncertainty_by_count(rows) if reduced else rows
    marks = _medians(drawn_rows) if reduced else [_points(drawn_rows)]
    single = float(rows["sigma_single_mas"].iloc[0])
    n_sources = rows["source_id"].nunique()
    what = "median and 16–84 % range at each N" if reduced else "one point per source"
    return framed(
        [_law(single, limits[0]), *marks],
        title=f"Uncertainty of {_NAMES[coordinate]}",
        subtitle=f"{n_sources:,} {plural(n_sources, 'source')}, {what}",
        x=Axis(_XLABEL, limits[0], is_log=True, ticks=log_ticks(limits[0], whole=True)),
        y=Axis("σ (mas)", limits[1], is_log=True, ticks=log_ticks(limits[1])),
        width=width,
        height=width,
        legend_columns=2,
    )


def _limits(table: pd.DataFrame) -> tuple[Limits, Limits]:
    n, sigma = table["n_obs"], table["sigma_mas"]
    return (
        (0.85 * float(n.min()), 1.18 * float(n.max())),
        (0.8 * float(sigma.min()), 1.25 * float(sigma.max())),
    )


def _with_series(table: pd.DataFrame) -> pd.DataFrame:
    names = table["source_class"] + ", " + table["kind"]
    return table.assign(series=names)


_COLOUR = By(
    "series", {f"{name}, {kind}": CLASS_COLOURS[name] for name in CLASSES for kind in KINDS}
)
_MARKER = By("kind", {"marginal": "circle", "conditional": "inverted_triangle"})
_FILL_ALPHA = By("kind", {"marginal": 0.75, "conditional": 0.0})


def _points(rows: pd.DataFrame, size: float = 5.0, hover: Tooltips = _HOVER) -> Glyphs:
    return points(
        _with_series(rows),
        "n_obs",
        "sigma_mas",
        name="sources",
        color=_COLOUR,
        marker=_MARKER,
        size=size,
        alpha=0.8,
        fill_alpha=_FILL_ALPHA,
        hover=hover,
        label="@series",
    )


def _medians(rows: pd.DataFrame) -> list[Glyphs]:
    n, series = rows["n_obs"], _with_series(rows)["series"]
    bars = segments(
        n,
        rows["low"],
        n,
        rows["high"],
        name="ranges",
        color=_COLOUR,
        alpha=0.5,
        keep={"series": series},
    )
    return [bars, _points(rows, 6.0, _HOVER_MEDIAN)]


def _law(single: float, xlim: Limits) -> Glyphs:
    n = np.geomspace(*xlim, 32)
    label = f"{single:.2f} mas / √N"
    return line(n, single / np.sqrt(n), name="law", color="line", dash="dashed", label=label)


def _plot(chosen: Chosen) -> Figure:
    return plot_uncertainty(uncertainty(chosen.result, chosen.instrument))


DIAGNOSTICS = (
    Diagnostic(
        "uncertainty",
        "Uncertainty against number of measurements",
        "The conditional uncertainty (calibration fixed) falls with the square root of N by "
        "construction. The marginal one (calibration integrated out) is the actual uncertainty. "
        "Good: marginal values close above the conditional ones; the difference is the "
        "uncertainty that the calibration adds.",
        OrbitWorkspace.SKY,
        60,
        _plot,
        is_wide=True,
        is_key=True,
        equation=(
            "σ²(marginal) = σ²(conditional) + J C Jᵀ, with the covariance C of the "
            "calibration and the shift J of the source per parameter; σ(conditional) ≈ "
            "σ(one measurement) / √N"
        ),
    ),
)
