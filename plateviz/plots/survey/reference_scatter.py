"""Scatter of the reference sources between orbits, and their deviations over sigma."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import (
    Axis,
    Figure,
    Glyphs,
    Limits,
    Ramp,
    framed,
    message,
    side_by_side,
)
from plateviz.figures.glyphs import line, points, rectangles
from plateviz.plots.elements.points import steps, unit_normal
from plateviz.plots.elements.style import PANEL_WIDTH, ROW_LIMIT, SERIES_COLOURS
from plateviz.plots.elements.ticks import log_ticks
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.tables.histogram import pull_bins
from plateviz.tables.reference_scatter import LEAST_ORBITS, reference_scatter, scatter_cells
from plateviz.tables.rounded import with_minus_signs
from plateviz.tables.survey_tables import SurveyTables
from solver.data.plural import plural

_TITLE = "Scatter of the reference sources"
_NAMES = {"ra": "α cos δ", "dec": "δ"}
_XLABEL, _YLABEL = "predicted scatter (mas)", "measured scatter (mas)"
_HOVER = [
    ("source", "@{id}"),
    ("orbits", "@{n_orbits}"),
    ("measured", "@{scatter_mas}{0.0000} mas"),
    ("predicted", "@{expected_mas}{0.0000} mas"),
    ("mean deviation", "@{deviation_mas}{0.0000} ± @{deviation_sigma_mas}{0.0000} mas"),
]


def plot_reference_scatter(table: pd.DataFrame, *, width: int = PANEL_WIDTH) -> Figure:
    """Draw measured against predicted scatter for each coordinate, and the deviations' pulls.

    Above 20,000 sources the number in each cell is drawn. The panel of deviations requires a
    truth.

    Parameters
    ----------
    table : `tables.reference_scatter`
    width : of each panel's frame, screen pixels
    """
    positive = table[(table["scatter_mas"] > 0) & (table["expected_mas"] > 0)]
    if positive.empty:
        text = (
            f"No reference source in {LEAST_ORBITS} orbits or more yet. From then on: the scatter "
            "of each between orbits against the predicted one."
        )
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    limits = _limits(positive)
    panels = [
        _scatter(positive[positive["coordinate"] == axis], axis, limits, width) for axis in _NAMES
    ]
    if table["pull"].notna().any():
        panels.append(_deviations(table, width))
    return side_by_side(panels, columns=3)


def _scatter(rows: pd.DataFrame, axis: str, limits: Limits, width: int) -> Figure:
    is_dense = len(rows) > ROW_LIMIT
    sources = _cells(rows) if is_dense else _points(rows)
    counted = "; colour: number per cell" if is_dense else ""
    ratio = float(np.median(rows["scatter_mas"] / rows["expected_mas"]))
    return framed(
        [sources, _identity(limits)],
        title=f"Scatter between orbits, {_NAMES[axis]}",
        subtitle=f"{len(rows):,} reference {plural(len(rows), 'source')}{counted}\n"
        f"median of measured / predicted: {ratio:.3f}",
        x=Axis(_XLABEL, limits, is_log=True, ticks=log_ticks(limits)),
        y=Axis(_YLABEL, limits, is_log=True, ticks=log_ticks(limits)),
        width=width,
        height=width,
        legend_columns=1,
    )


def _identity(limits: Limits) -> Glyphs:
    label = "measured = predicted"
    return line(limits, limits, name="identity", color="line", dash="dashed", label=label)


def _points(rows: pd.DataFrame) -> Glyphs:
    return points(
        rows,
        "expected_mas",
        "scatter_mas",
        name="sources",
        color=SERIES_COLOURS[1],
        size=4.0,
        alpha=0.45,
        line_width=0.0,
        hover=_HOVER,
    )


def _cells(rows: pd.DataFrame) -> Glyphs:
    cells = scatter_cells(rows).rename(columns={"low": "bottom", "high": "top"})
    limits = (float(cells["n"].min()), float(cells["n"].max()))
    return rectangles(
        cells,
        name="cells",
        color=Ramp("n", "count", limits, is_log=True),
        hover=[("sources", "@{n}")],
    )


def _deviations(table: pd.DataFrame, width: int) -> Figure:
    parts = {axis: pull_bins(table["pull"][table["coordinate"] == axis]) for axis in _NAMES}
    bins = parts["ra"]
    limit = float(bins["right"].max())
    normal = unit_normal(float(bins["n"].iloc[0] * (bins["right"] - bins["left"]).iloc[0]), limit)
    counts = [part["count"].max() for part in parts.values()]
    top = 1.1 * max(*map(float, counts), float(normal.values("y").max()))
    means = {axis: with_minus_signs(f"{part['mean'].iloc[0]:.2f}") for axis, part in parts.items()}
    subtitle = "\n".join(
        f"{_NAMES[axis]}: mean {means[axis]}, sd {part['sd'].iloc[0]:.2f}, "
        f"{part['outside'].iloc[0]:,} beyond ± {limit:g}"
        for axis, part in parts.items()
    )
    return framed(
        [
            *(
                steps(part, _NAMES[axis], SERIES_COLOURS[number])
                for number, (axis, part) in enumerate(parts.items())
            ),
            normal,
        ],
        title="Mean deviation from the truth",
        subtitle=subtitle,
        x=Axis("mean deviation over its expected σ", (-limit, limit)),
        y=Axis("sources per bin", (0.0, top)),
        width=width,
        height=width,
        legend_columns=3,
    )


def _limits(rows: pd.DataFrame) -> Limits:
    values = rows[["scatter_mas", "expected_mas"]].to_numpy(dtype=float)
    return 0.85 * float(values.min()), 1.18 * float(values.max())


# Three panels side by side on the page.
_PAGE_WIDTH = 270


def _plot(tables: SurveyTables) -> Figure:
    return plot_reference_scatter(reference_scatter(tables.motions), width=_PAGE_WIDTH)


SURVEY_FIGURES = (
    SurveyFigure(
        "reference-scatter",
        "Scatter of the reference sources",
        "The scatter of each reference source between orbits against the noise that the fits "
        "predict, and its mean deviation over its expected sigma from noise and catalogue. Good: "
        "points about the line, and a unit normal. The scatter is far below the reported sigma, "
        "because the error of a prior is the same in every orbit.",
        SurveyWorkspace.ACCURACY,
        50,
        _plot,
        is_wide=True,
        column_height=760,
        equation=(
            "measured: standard deviation of the estimates of all orbits; predicted: "
            "rms of their σ(noise); deviation: (mean − truth) / its σ from noise and "
            "catalogue"
        ),
    ),
)
