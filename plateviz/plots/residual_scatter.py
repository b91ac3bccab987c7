"""Residual x against y on the detectors (paper, figure "residual:detector", bottom)."""

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.points import raster
from plateviz.plots.style import (
    CLASS_COLOURS,
    FRAME_WIDTH,
    ROW_LIMIT,
    SERIES_COLOURS,
    drawn,
    framed,
    message,
)
from plateviz.plots.theme import theme_of
from plateviz.tables.residuals import ScatterStatistics, residual_scatter, scatter_statistics
from plateviz.tables.sources import REFERENCE

_TITLE = "Residuals on the detectors, measured minus predicted"
_X = hv.Dimension("residual_x_mpix", label="residual x (mpix)")
_Y = hv.Dimension("residual_y_mpix", label="residual y (mpix)")
_HOVER = [
    ("source", "@{id}"),
    ("exposure", "@{exposure}"),
    ("detector", "@{detector_id}"),
    ("residual x", "@{residual_x_mpix}{0.00} mpix"),
    ("residual y", "@{residual_y_mpix}{0.00} mpix"),
]
_LEAST_SIGMAS = 3.5


def plot_residual_scatter(
    table: pd.DataFrame,
    *,
    theme: str = "light",
    width: int = FRAME_WIDTH,
    dynamic: bool = False,
) -> hv.Overlay:
    """Draw residual x against y, with the 1 and 2 sigma ellipses of the expected noise.

    Parameters
    ----------
    table : `tables.residual_scatter`; coloured by exposure up to six of them, rasterised
        above 20,000 rows
    theme : "light" or "dark"
    width : of the frame, screen pixels
    dynamic : whether a raster is counted again at each zoom, which needs a live server
    """
    if table.empty:
        return message(
            _TITLE, "No measurements", theme=theme, width=width, xlabel=_X.label, ylabel=_Y.label
        )
    statistics = scatter_statistics(table)
    expected = (statistics.expected_x, statistics.expected_y)
    values = np.abs(table[["residual_x_mpix", "residual_y_mpix"]].to_numpy(dtype=float))
    half = 1.05 * max(float(values.max()), _LEAST_SIGMAS * max(expected))
    limits = (-half, half)
    points = _points(table)
    if len(table) > ROW_LIMIT:
        data = raster(points, half=half, width=width, theme=theme, dynamic=dynamic)
        line = CLASS_COLOURS[REFERENCE]  # visible on dark and on light cells
    else:
        data, line = [points], theme_of(theme).line
    return framed(
        [*data, *_expected(expected, line)],
        title=_TITLE,
        subtitle=_subtitle(statistics),
        theme=theme,
        width=width,
        xlim=limits,
        ylim=limits,
        xlabel=_X.label,
        ylabel=_Y.label,
        legend_columns=3,
    )


def _points(table: pd.DataFrame) -> hv.Points:
    exposures = list(table["exposure"].unique())
    points = hv.Points(table, [_X, _Y], ["exposure", "id", "detector_id"])
    if len(exposures) <= len(SERIES_COLOURS):
        colour = {"color": "exposure", "cmap": dict(zip(exposures, SERIES_COLOURS, strict=False))}
    else:
        colour = {"color": SERIES_COLOURS[0]}
    return drawn(
        points,
        size=4,
        alpha=0.8,
        line_color=None,
        nonselection_alpha=0.1,
        tools=["hover"],
        hover_tooltips=_HOVER,
        **colour,
    )


def _expected(sigma: tuple[float, float], colour: str) -> list[hv.Curve]:
    turn = np.linspace(0.0, 2.0 * np.pi, 121)
    styles = {1: ("solid", "1σ expected, 39 % inside"), 2: ("dashed", "2σ expected, 86 % inside")}
    return [
        drawn(
            hv.Curve(
                (k * sigma[0] * np.cos(turn), k * sigma[1] * np.sin(turn)), _X, _Y, label=label
            ),
            color=colour,
            line_width=1.8,
            line_dash=dash,
        )
        for k, (dash, label) in styles.items()
    ]


def _subtitle(statistics: ScatterStatistics) -> str:
    count = statistics.n_exposures
    return (
        f"n = {statistics.n:,} in {count} exposure{'s' if count > 1 else ''}; "
        f"rms x {statistics.rms_x:.2f}, y {statistics.rms_y:.2f} mpix; "
        f"expected x {statistics.expected_x:.2f}, y {statistics.expected_y:.2f} mpix"
    )


def _draw(chosen: Chosen, theme: str) -> hv.Overlay:
    table = residual_scatter(chosen.result, exposures=chosen.exposures, detector_id=chosen.detector)
    return plot_residual_scatter(table, theme=theme)


DIAGNOSTICS = (
    Diagnostic(
        "residual-scatter",
        "Residual scatter",
        "Residuals of the selected exposures and detector, x against y. Good: a round cloud "
        "about zero, as wide as the measurement errors predict.",
        30,
        _draw,
        follows_selection=True,
    ),
)
