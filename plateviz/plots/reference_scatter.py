"""Scatter of the reference sources between orbits, and their deviations over sigma."""

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.points import steps, unit_normal
from plateviz.plots.style import (
    PANEL_WIDTH,
    ROW_LIMIT,
    SERIES_COLOURS,
    Limits,
    drawn,
    framed,
    message,
    side_by_side,
)
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.theme import theme_of
from plateviz.plots.ticks import log_ticks
from plateviz.tables.histogram import pull_bins
from plateviz.tables.reference_scatter import LEAST_ORBITS, reference_scatter, scatter_cells
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "Scatter of the reference sources"
_NAMES = {"ra": "α cos δ", "dec": "δ"}
_X = hv.Dimension("expected_mas", label="predicted scatter (mas)")
_HOVER = [
    ("source", "@{id}"),
    ("orbits", "@{n_orbits}"),
    ("measured", "@{scatter_mas}{0.0000} mas"),
    ("predicted", "@{expected_mas}{0.0000} mas"),
    ("mean deviation", "@{deviation_mas}{0.0000} ± @{deviation_sigma_mas}{0.0000} mas"),
]
_EXTRA = ["id", "n_orbits", "deviation_mas", "deviation_sigma_mas", "scatter_mas"]


def plot_reference_scatter(
    table: pd.DataFrame, *, theme: str = "light", width: int = PANEL_WIDTH
) -> hv.Layout | hv.Overlay:
    """Draw measured against predicted scatter for each coordinate, and the deviations' pulls.

    Above 20,000 sources the number in each cell is drawn. The panel of deviations requires a
    truth.

    Parameters
    ----------
    table : `tables.reference_scatter`
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels
    """
    positive = table[(table["scatter_mas"] > 0) & (table["expected_mas"] > 0)]
    if positive.empty:
        return message(
            _TITLE,
            f"No reference source in {LEAST_ORBITS} orbits",
            theme=theme,
            width=width,
            xlabel=_X.label,
            ylabel="measured scatter (mas)",
        )
    limits = _limits(positive)
    panels = [
        _scatter(positive[positive["coordinate"] == axis], axis, limits, theme, width)
        for axis in _NAMES
    ]
    if table["pull"].notna().any():
        panels.append(_deviations(table, theme, width))
    return side_by_side(panels, columns=3)


def _scatter(rows: pd.DataFrame, axis: str, limits: Limits, theme: str, width: int) -> hv.Overlay:
    line = hv.Curve((limits, limits), _X, f"scatter_{axis}", label="measured = predicted")
    is_dense = len(rows) > ROW_LIMIT
    sources = _cells(rows, theme) if is_dense else _points(rows, axis)
    counted = "; colour: number per cell" if is_dense else ""
    ratio = float(np.median(rows["scatter_mas"] / rows["expected_mas"]))
    return framed(
        [sources, drawn(line, color=theme_of(theme).line, line_width=1.6, line_dash="dashed")],
        title=f"Scatter between orbits, {_NAMES[axis]}",
        subtitle=f"{len(rows):,} reference sources{counted}\n"
        f"median of measured / predicted: {ratio:.3f}",
        theme=theme,
        width=width,
        height=width,
        xlim=limits,
        ylim=limits,
        logx=True,
        logy=True,
        xticks=log_ticks(limits),
        yticks=log_ticks(limits),
        xlabel=_X.label,
        ylabel="measured scatter (mas)",
        legend_columns=1,
    )


def _points(rows: pd.DataFrame, axis: str) -> hv.Points:
    y = f"scatter_{axis}"
    data = rows[[*_EXTRA, "expected_mas"]].assign(**{y: rows["scatter_mas"]})
    return drawn(
        hv.Points(data, [_X, hv.Dimension(y)], _EXTRA),
        color=SERIES_COLOURS[1],
        size=4,
        alpha=0.45,
        line_color=None,
        nonselection_alpha=0.1,
        tools=["hover"],
        hover_tooltips=_HOVER,
    )


def _cells(rows: pd.DataFrame, theme: str) -> hv.Rectangles:
    cells = hv.Rectangles(scatter_cells(rows), ["left", "low", "right", "high"], ["n"])
    return drawn(
        cells,
        color="n",
        cmap=theme_of(theme).count_palette,
        cnorm="log",
        line_color=None,
        tools=["hover"],
        hover_tooltips=[("sources", "@{n}")],
    )


def _deviations(table: pd.DataFrame, theme: str, width: int) -> hv.Overlay:
    parts = {axis: pull_bins(table["pull"][table["coordinate"] == axis]) for axis in _NAMES}
    bins = parts["ra"]
    limit = float(bins["right"].max())
    normal = unit_normal(
        float(bins["n"].iloc[0] * (bins["right"] - bins["left"]).iloc[0]), limit, theme
    )
    counts = [*(float(part["count"].max()) for part in parts.values()), normal.range("count")[1]]
    subtitle = "\n".join(
        f"{_NAMES[axis]}: mean {part['mean'].iloc[0]:.2f}, sd {part['sd'].iloc[0]:.2f}, "
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
        theme=theme,
        width=width,
        height=width,
        xlim=(-limit, limit),
        ylim=(0.0, 1.1 * max(counts)),
        xlabel="mean deviation over its expected σ",
        ylabel="sources per bin",
        legend_columns=3,
    )


def _limits(rows: pd.DataFrame) -> Limits:
    values = rows[["scatter_mas", "expected_mas"]].to_numpy(dtype=float)
    return 0.85 * float(values.min()), 1.18 * float(values.max())


# Three panels side by side on the page.
_PAGE_WIDTH = 270


def _draw(tables: SurveyTables, theme: str) -> hv.Layout | hv.Overlay:
    return plot_reference_scatter(reference_scatter(tables.motions), theme=theme, width=_PAGE_WIDTH)


SURVEY_FIGURES = (
    SurveyFigure(
        "reference-scatter",
        "Scatter of the reference sources",
        "The scatter of each reference source between orbits against the noise that the fits "
        "predict, and its mean deviation over its expected sigma from noise and catalogue. Good: "
        "points about the line, and a unit normal. The scatter is far below the reported sigma, "
        "because the error of a prior is the same in every orbit.",
        50,
        _draw,
        is_wide=True,
    ),
)
