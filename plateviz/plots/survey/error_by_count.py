"""Errors of the artificial sources against orbits (paper, figure "discussion:test:rms")."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, Glyphs, Limits, framed, message
from plateviz.figures.glyphs import line, points, segments
from plateviz.plots.elements.style import CLASS_COLOURS
from plateviz.plots.elements.ticks import log_ticks
from plateviz.plots.elements.units import angle_text
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.tables.counts import orbits_text
from plateviz.tables.sources import ARTIFICIAL, REFERENCE
from plateviz.tables.survey_tables import SurveyTables
from solver.data.plural import plural

_TITLE = "Positional error of the artificial sources"
_XLABEL = "number of orbits N"
_YLABEL = "rms error of the mean, one coordinate (mas)"
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
    width: int = FRAME_WIDTH,
) -> Figure:
    """Draw the error of the mean position against the number of orbits, with two predictions.

    Parameters
    ----------
    table : `survey_schema.ERRORS_BY_COUNT`
    measurement_mas : uncertainty of one measurement, for the paper's law
        sigma / sqrt(36 N), section "Discussion"
    per_orbit : measurements of a source in one orbit, 36 in that law
    width : of the frame, screen pixels
    """
    if table.empty:
        text = "No artificial sources"
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    rows = table.sort_values("n_orbits", kind="stable")
    xlim, ylim = _limits(rows)
    return framed(
        [_law(measurement_mas, per_orbit, xlim), *_predictions(rows), *_errors(rows)],
        title=_TITLE,
        subtitle=_subtitle(rows),
        x=Axis(_XLABEL, xlim, is_log=True, ticks=log_ticks(xlim, whole=True)),
        y=Axis(_YLABEL, ylim, is_log=True, ticks=log_ticks(ylim)),
        width=width,
        height=round(0.8 * width),
        legend_columns=2,
    )


def _law(measurement_mas: float, per_orbit: int, xlim: Limits) -> Glyphs:
    n = np.array(xlim)
    return line(
        n,
        measurement_mas / np.sqrt(per_orbit * n),
        name="law",
        color="muted",
        width=1.8,
        dash="dotted",
        label=f"{measurement_mas:g} mas / √({per_orbit} N)",
    )


def _predictions(rows: pd.DataFrame) -> list[Glyphs]:
    n, floor, expected = rows["n_orbits"], rows["floor_mas"], rows["expected_mas"]
    return [
        line(
            n,
            floor,
            name="floor",
            color=CLASS_COLOURS[REFERENCE],
            width=1.8,
            dash="dashed",
            label="floor: references",
        ),
        line(
            n,
            expected,
            name="prediction",
            color="line",
            width=1.8,
            label="√(noise² / N + floor²)",
        ),
    ]


def _errors(rows: pd.DataFrame) -> list[Glyphs]:
    colour = CLASS_COLOURS[ARTIFICIAL]
    n = rows["n_orbits"]
    bars = segments(
        n,
        rows["error_low_mas"],
        n,
        rows["error_high_mas"],
        name="error bars",
        color=colour,
        alpha=0.6,
        width=1.4,
    )
    errors = points(
        rows,
        "n_orbits",
        "error_mas",
        name="errors",
        color=colour,
        marker="triangle",
        size=7.0,
        line_width=0.0,
        hover=_HOVER,
        label="measured ± 1σ",
    )
    return [bars, errors]


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
    most = int(rows["n_sources"].max())
    noise, floor = angle_text(float(first["noise_mas"])), angle_text(float(last["floor_mas"]))
    orbits = orbits_text(int(first["n_orbits"]))
    return (
        f"{most:,} {plural(most, 'source')}; noise of {orbits} {noise}; "
        f"floor at {orbits_text(int(last['n_orbits']))} {floor}"
    )


def _plot(tables: SurveyTables) -> Figure:
    table = tables.errors_by_count
    if table is None:
        text = "No artificial sources with a truth"
        return message(_TITLE, text, xlabel=_XLABEL, ylabel=_YLABEL)
    return plot_error_by_count(table)


SURVEY_FIGURES = (
    SurveyFigure(
        "error-by-count",
        "Error against number of orbits",
        "The error of the mean position over N orbits. Good: points along the solid prediction. "
        "The paper's square-root law has no floor; the errors of the reference sources are the "
        "same in every orbit and do not average out.",
        SurveyWorkspace.ACCURACY,
        40,
        _plot,
        equation=(
            "error²(N) = noise² / N + floor²; the paper's law: error = σ(one "
            "measurement) / √(n N), n measurements in an orbit"
        ),
    ),
)
