"""Uncertainty against the number of measurements (paper, figure "uncertainty")."""

from typing import Literal

import holoviews as hv
import numpy as np
import pandas as pd
from holoviews import dim

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.style import (
    CLASS_COLOURS,
    PANEL_WIDTH,
    ROW_LIMIT,
    Limits,
    drawn,
    framed,
    message,
    side_by_side,
)
from plateviz.plots.theme import theme_of
from plateviz.plots.ticks import log_ticks
from plateviz.tables.sources import CLASSES, KINDS, uncertainty, uncertainty_by_count

Coordinate = Literal["ra", "dec", "both"]

_TITLE = "Uncertainty against number of measurements"
_NAMES = {"ra": "α cos δ", "dec": "δ"}
_MARKERS = {"marginal": "circle", "conditional": "inverted_triangle"}
_X = hv.Dimension("n_obs", label="number of measurements N")
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
    table: pd.DataFrame,
    *,
    coordinate: Coordinate = "both",
    theme: str = "light",
    width: int = PANEL_WIDTH,
) -> hv.Layout | hv.Overlay:
    """Draw conditional and marginal uncertainties against N, with the square-root law.

    Above 20,000 points in a panel, the median at each N is drawn with the range from the 16th
    to the 84th percentile.

    Parameters
    ----------
    table : `tables.uncertainty`
    coordinate : "ra", "dec", or "both" for a panel each
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels
    """
    wanted = ("ra", "dec") if coordinate == "both" else (coordinate,)
    shown = table[(table["n_obs"] > 0) & (table["sigma_mas"] > 0)] if len(table) else table
    if shown.empty:
        return message(
            _TITLE, "No sources", theme=theme, width=width, xlabel=_X.label, ylabel="σ (mas)"
        )
    limits = _limits(shown)
    panels = [
        _panel(shown[shown["coordinate"] == name], name, limits, theme, width) for name in wanted
    ]
    return panels[0] if len(panels) == 1 else side_by_side(panels, columns=2, linked=True)


def _panel(
    rows: pd.DataFrame, coordinate: str, limits: tuple[Limits, Limits], theme: str, width: int
) -> hv.Overlay:
    label = f"σ of {_NAMES[coordinate]} (mas)"
    reduced = len(rows) > ROW_LIMIT
    drawn_rows = uncertainty_by_count(rows) if reduced else rows
    marks = _medians(drawn_rows) if reduced else [_points(drawn_rows)]
    single = float(rows["sigma_single_mas"].iloc[0])
    what = "median and 16–84 % range at each N" if reduced else "one point per source"
    return framed(
        [_law(single, limits[0], theme), *marks],
        title=f"Uncertainty of {_NAMES[coordinate]} against N",
        subtitle=f"{rows['id'].nunique():,} sources, {what}",
        theme=theme,
        width=width,
        xlim=limits[0],
        ylim=limits[1],
        height=width,
        xticks=log_ticks(limits[0], whole=True),
        yticks=log_ticks(limits[1]),
        logx=True,
        logy=True,
        xlabel=_X.label,
        ylabel=label,
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


def _colours() -> dict[str, str]:
    return {f"{name}, {kind}": CLASS_COLOURS[name] for name in CLASSES for kind in KINDS}


def _points(rows: pd.DataFrame) -> hv.Points:
    points = hv.Points(
        _with_series(rows), [_X, hv.Dimension("sigma_mas")], ["series", "id", "kind"]
    )
    return drawn(points, size=5, **_look(), hover_tooltips=_HOVER)


def _medians(rows: pd.DataFrame) -> list[hv.Element]:
    data = _with_series(rows)
    points = hv.Points(data, [_X, hv.Dimension("sigma_mas")], ["series", "n", "kind"])
    bars = hv.Segments(
        data.assign(n_obs_end=data["n_obs"]), ["n_obs", "low", "n_obs_end", "high"], ["series"]
    )
    return [
        drawn(bars, color="series", cmap=_colours(), alpha=0.5, show_legend=False),
        drawn(points, size=6, **_look(), hover_tooltips=_HOVER_MEDIAN),
    ]


def _look() -> dict[str, object]:
    return {
        "color": "series",
        "cmap": _colours(),
        "marker": dim("kind").categorize(_MARKERS, default="circle"),
        "fill_alpha": dim("kind").categorize({"marginal": 0.75, "conditional": 0.0}, default=0.5),
        "line_alpha": 0.8,
        "nonselection_alpha": 0.1,
        "tools": ["hover"],
    }


def _law(single: float, xlim: tuple[float, float], theme: str) -> hv.Curve:
    n = np.geomspace(*xlim, 32)
    curve = hv.Curve((n, single / np.sqrt(n)), "n_obs", "sigma_mas", label=f"{single:.2f} mas / √N")
    return drawn(curve, color=theme_of(theme).line, line_dash="dashed", line_width=1.6)


def _draw(chosen: Chosen, theme: str) -> hv.Layout | hv.Overlay:
    return plot_uncertainty(uncertainty(chosen.result, chosen.instrument), theme=theme)


DIAGNOSTICS = (
    Diagnostic(
        "uncertainty",
        "Uncertainty against number of measurements",
        "The conditional uncertainty (calibration fixed) falls with the square root of N by "
        "construction. The marginal one (calibration integrated out) is the actual uncertainty. "
        "Good: marginal values close above the conditional ones; the difference is the "
        "uncertainty that the calibration adds.",
        60,
        _draw,
        is_wide=True,
    ),
)
