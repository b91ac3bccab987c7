"""Errors of the artificial sources against orbits (paper, figure "discussion:test:rms")."""

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.style import (
    CLASS_COLOURS,
    FRAME_WIDTH,
    AxisLabels,
    Limits,
    drawn,
    framed,
    message,
)
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.theme import theme_of
from plateviz.plots.ticks import log_ticks
from plateviz.plots.units import angle_text
from plateviz.tables.sources import ARTIFICIAL, REFERENCE
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "Positional error of the artificial sources"
_LABELS: AxisLabels = {
    "xlabel": "number of orbits N",
    "ylabel": "rms error of the mean, one coordinate (mas)",
}
_X, _Y = hv.Dimension("n_orbits"), hv.Dimension("error_mas")
_HOVER = [
    ("orbits", "@{n_orbits}"),
    ("sources", "@{n_sources}"),
    ("rms error", "@{error_mas}{0.0000} mas"),
    ("its range", "@{error_low_mas}{0.0000} to @{error_high_mas}{0.0000} mas"),
    ("expected", "@{expected_mas}{0.0000} mas"),
]
_MEASUREMENT_MAS = 4.0
_PER_ORBIT = 36


def plot_error_by_count(
    table: pd.DataFrame,
    *,
    measurement_mas: float = _MEASUREMENT_MAS,
    per_orbit: int = _PER_ORBIT,
    theme: str = "light",
    width: int = FRAME_WIDTH,
) -> hv.Overlay:
    """Draw the error of the mean position against the number of orbits, with two predictions.

    Parameters
    ----------
    table : `survey_schema.ERRORS_BY_COUNT`
    measurement_mas : uncertainty of one measurement, for the paper's law
        sigma / sqrt(36 N), section "Discussion"
    per_orbit : measurements of a source in one orbit, 36 in that law
    theme : "light" or "dark"
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No artificial sources", theme=theme, width=width, **_LABELS)
    rows = table.sort_values("n_orbits", kind="stable")
    colours = theme_of(theme)
    law_label = f"{measurement_mas:g} mas / √({per_orbit} N)"
    xlim, ylim = _limits(rows)
    span = np.array(xlim)
    law = measurement_mas / np.sqrt(per_orbit * span)
    n = rows["n_orbits"]
    return framed(
        [
            _curve(span, law, law_label, colours.muted, "dotted"),
            _curve(n, rows["floor_mas"], "floor: references", CLASS_COLOURS[REFERENCE], "dashed"),
            _curve(n, rows["expected_mas"], "√(noise² / N + floor²)", colours.line, "solid"),
            *_errors(rows),
        ],
        title=_TITLE,
        subtitle=_subtitle(rows),
        theme=theme,
        width=width,
        height=round(0.8 * width),
        xlim=xlim,
        ylim=ylim,
        logx=True,
        logy=True,
        xticks=log_ticks(xlim, whole=True),
        yticks=log_ticks(ylim),
        legend_columns=2,
        **_LABELS,
    )


def _curve(
    n: np.ndarray | pd.Series, values: np.ndarray | pd.Series, label: str, colour: str, dash: str
) -> hv.Curve:
    curve = hv.Curve(
        (np.asarray(n, dtype=float), np.asarray(values, dtype=float)), _X, _Y, label=label
    )
    return drawn(curve, color=colour, line_width=1.8, line_dash=dash)


def _errors(rows: pd.DataFrame) -> list[hv.Element]:
    colour = CLASS_COLOURS[ARTIFICIAL]
    ends = rows.assign(n_orbits_end=rows["n_orbits"])
    bars = hv.Segments(ends, ["n_orbits", "error_low_mas", "n_orbits_end", "error_high_mas"])
    extra = ["n_sources", "error_low_mas", "error_high_mas", "expected_mas"]
    points = hv.Points(rows, [_X, _Y], extra, label="measured ± 1σ")
    return [
        drawn(bars, color=colour, alpha=0.6, line_width=1.4, show_legend=False),
        drawn(
            points,
            color=colour,
            marker="triangle",
            size=7,
            line_color=None,
            tools=["hover"],
            hover_tooltips=_HOVER,
        ),
    ]


def _limits(rows: pd.DataFrame) -> tuple[Limits, Limits]:
    n = rows["n_orbits"]
    seen = rows[["error_mas", "expected_mas", "floor_mas"]].to_numpy(dtype=float)
    # The lower end of a bar is not used: with few sources it may be zero, which has no logarithm.
    low, high = float(np.nanmin(seen[seen > 0])), float(rows["error_high_mas"].max())
    return (
        (0.92 * float(n.min()), 1.09 * float(n.max())),
        (0.75 * low, 1.2 * max(high, float(np.nanmax(seen)))),
    )


def _subtitle(rows: pd.DataFrame) -> str:
    first, last = rows.iloc[0], rows.iloc[-1]
    noise, floor = angle_text(float(first["noise_mas"])), angle_text(float(last["floor_mas"]))
    orbits = f"{int(first['n_orbits'])} orbit{'s' if first['n_orbits'] > 1 else ''}"
    return (
        f"{int(rows['n_sources'].max()):,} sources; noise of {orbits} {noise}; "
        f"floor at {int(last['n_orbits'])} orbits {floor}"
    )


def _draw(tables: SurveyTables, theme: str) -> hv.Overlay:
    table = tables.errors_by_count
    if table is None:
        return message(_TITLE, "No artificial sources with a truth", theme=theme, **_LABELS)
    return plot_error_by_count(table, theme=theme)


SURVEY_FIGURES = (
    SurveyFigure(
        "error-by-count",
        "Error against number of orbits",
        "The error of the mean position over N orbits. Good: points along the solid prediction. "
        "The paper's square-root law has no floor; the errors of the reference sources are the "
        "same in every orbit and do not average out.",
        40,
        _draw,
    ),
)
