"""Residual x against y on the detectors (paper, figure "residual:detector", bottom)."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, By, Figure, Glyphs, framed, message
from plateviz.figures.glyphs import ellipse, points
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.points import raster
from plateviz.plots.elements.style import CLASS_COLOURS, ROW_LIMIT, SERIES_COLOURS
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.residuals import ScatterStatistics, residual_scatter, scatter_statistics
from plateviz.tables.sources import REFERENCE

_TITLE = "Residuals on the detectors, measured minus predicted"
_X, _Y = "residual_x_mpix", "residual_y_mpix"
_XLABEL, _YLABEL = "residual x (mpix)", "residual y (mpix)"
_HOVER = [
    ("source", "@{id}"),
    ("exposure", "@{exposure}"),
    ("detector", "@{detector_id}"),
    ("residual x", "@{residual_x_mpix}{0.00} mpix"),
    ("residual y", "@{residual_y_mpix}{0.00} mpix"),
]
_LEAST_SIGMAS = 3.5


def plot_residual_scatter(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw residual x against y, with the 1 and 2 sigma ellipses of the expected noise.

    Parameters
    ----------
    table : `tables.residual_scatter`; coloured by exposure up to six of them, rasterised
        above 20,000 rows
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No measurements", width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    statistics = scatter_statistics(table)
    expected = (statistics.expected_x, statistics.expected_y)
    x, y = (table[name].to_numpy(dtype=float) for name in (_X, _Y))
    half = 1.05 * max(float(np.abs([x, y]).max()), _LEAST_SIGMAS * max(expected))
    if len(table) > ROW_LIMIT:
        data = raster(x, y, half=half, width=width)
        colour = CLASS_COLOURS[REFERENCE]  # visible on dark and on light cells
    else:
        data, colour = [_points(table)], "line"
    return framed(
        [*data, *_expected(expected, colour)],
        title=_title(table),
        subtitle=_subtitle(statistics),
        x=Axis(_XLABEL, (-half, half)),
        y=Axis(_YLABEL, (-half, half)),
        width=width,
        legend_columns=3,
    )


def _title(table: pd.DataFrame) -> str:
    detectors = table["detector_id"].unique()
    return _TITLE if len(detectors) > 1 else f"Residuals on detector {detectors[0]}, x against y"


def _points(table: pd.DataFrame) -> Glyphs:
    exposures = list(table["exposure"].unique())
    is_coloured = len(exposures) <= len(SERIES_COLOURS)
    by = By("exposure", dict(zip(exposures, SERIES_COLOURS, strict=False)))
    return points(
        table,
        _X,
        _Y,
        name="measurements",
        color=by if is_coloured else SERIES_COLOURS[0],
        size=4.0,
        alpha=0.8,
        line_width=0.0,
        hover=_HOVER,
        label="@exposure" if is_coloured else "",
    )


def _expected(sigma: tuple[float, float], colour: str) -> list[Glyphs]:
    styles = {1: ("solid", "1σ expected, 39 % inside"), 2: ("dashed", "2σ expected, 86 % inside")}
    return [
        ellipse(
            np.diag(np.square(sigma)), scale=k, name=f"{k}σ", color=colour, dash=dash, label=label
        )
        for k, (dash, label) in styles.items()
    ]


def _subtitle(statistics: ScatterStatistics) -> str:
    count = statistics.n_exposures
    return (
        f"n = {statistics.n:,} in {count} exposure{'s' if count > 1 else ''}; "
        f"rms x, y {statistics.rms_x:.2f}, {statistics.rms_y:.2f} mpix; "
        f"expected {statistics.expected_x:.2f}, {statistics.expected_y:.2f} mpix"
    )


def _plot(chosen: Chosen) -> Figure:
    table = residual_scatter(chosen.result, exposures=chosen.exposures, detector_id=chosen.detector)
    return plot_residual_scatter(table)


DIAGNOSTICS = (
    Diagnostic(
        "residual-scatter",
        "Residual scatter",
        "Residuals of the shown exposures and detector, x against y. Good: a round cloud "
        "about zero, as wide as the measurement errors predict.",
        OrbitWorkspace.RESIDUALS,
        30,
        _plot,
        follows_shown=True,
        equation=(
            "r = n(measured) − n(predicted); expected σ² = s² (1 − h/2), with the error "
            "s of a measurement and its leverage h"
        ),
    ),
)
