"""One source's offsets in each coordinate against time, and their residuals."""

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.points import error_bars
from plateviz.plots.style import (
    PANEL_WIDTH,
    SERIES_COLOURS,
    Limits,
    drawn,
    framed,
    message,
    side_by_side,
)
from plateviz.plots.survey_figure import SourceFigure
from plateviz.plots.theme import theme_of
from plateviz.plots.units import orbits_text
from plateviz.tables.survey_tables import SourceTables
from plateviz.tables.time_series import time_series

_TITLE = "Time series"
_X = hv.Dimension("year", label="epoch (Julian year, TCB)")
_NAMES = {"ra": "α cos δ", "dec": "δ"}
_ZEROS = {
    "true": "truth",
    "fit": "fitted motion",
    "catalogue": "catalogue",
    "mean": "catalogue + mean",
}
_HOVER = [
    ("source", "@{id}"),
    ("orbit", "@{orbit_id}"),
    ("epoch", "@{year}{0.000}"),
    ("measurements", "@{n_obs}"),
    ("offset", "@{offset_mas}{0.000} ± @{sigma_mas}{0.000} mas"),
    ("from the fit", "@{residual_mas}{0.000} ± @{noise_mas}{0.000} mas"),
]
_EXTRA = ["id", "orbit_id", "n_obs", "offset_mas", "sigma_mas", "residual_mas", "noise_mas"]
_LEAST_PULL = 3.5
_MARGIN = 0.06


def plot_time_series(
    table: pd.DataFrame, *, theme: str = "light", width: int = PANEL_WIDTH
) -> hv.Layout | hv.Overlay:
    """Draw the offsets of one source against time, a panel per coordinate, linked in time.

    If the motion was fitted, panels below show the residuals over the noise of each orbit.

    Parameters
    ----------
    table : `tables.time_series`
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(
            _TITLE,
            "No orbits of this source",
            theme=theme,
            width=width,
            xlabel=_X.label,
            ylabel="offset (mas)",
        )
    parts = [(axis, table[table["coordinate"] == axis]) for axis in _NAMES]
    xlim = _spread(table["year"], least=1.0)
    panels = [_offsets(rows, axis, xlim, theme, width) for axis, rows in parts]
    if table["pull"].notna().any():
        panels += [_residuals(rows, axis, xlim, theme, width) for axis, rows in parts]
    return side_by_side(panels, columns=2, linked=True)


def _offsets(rows: pd.DataFrame, axis: str, xlim: Limits, theme: str, width: int) -> hv.Overlay:
    orbits, curve = rows[rows["kind"] == "orbit"], rows[rows["kind"] == "curve"]
    colours = theme_of(theme)
    zero = str(rows["zero"].iloc[0])
    # A separate name for each axis, because axes of the same name are linked.
    y = f"offset_{axis}_mas"
    lines = {"catalogue": colours.muted, "true": SERIES_COLOURS[1], "fit": colours.line}
    drawn_lines = [name for name in lines if curve[f"{name}_mas"].notna().any()]
    return framed(
        [
            *(_band(curve, y, colours.muted) if "fit" in drawn_lines else []),
            drawn(hv.HLine(0.0), color=colours.line, line_width=1, alpha=0.6),
            *(_line(curve, name, y, lines[name]) for name in drawn_lines),
            error_bars(orbits, "year", "offset_mas", "sigma_mas", SERIES_COLOURS[0]),
            _points(orbits, "offset_mas", y, "estimate ± 1σ", SERIES_COLOURS[0]),
        ],
        title=f"{_NAMES[axis]} of source {orbits['id'].iloc[0]}",
        subtitle=f"{orbits_text(len(orbits))}; {_remarks(orbits)}",
        theme=theme,
        width=width,
        height=round(0.62 * width),
        xlim=xlim,
        ylim=_offset_limits(rows),
        xlabel=_X.label,
        ylabel=f"{_NAMES[axis]} minus {_ZEROS[zero]} (mas)",
        legend_columns=4,
    )


def _residuals(rows: pd.DataFrame, axis: str, xlim: Limits, theme: str, width: int) -> hv.Overlay:
    orbits = rows[rows["kind"] == "orbit"]
    colours = theme_of(theme)
    half = 1.1 * max(_LEAST_PULL, float(orbits["pull"].abs().max()))
    sd = float(np.sqrt(np.mean(orbits["pull"] ** 2)))
    return framed(
        [
            drawn(hv.HSpan(-1.0, 1.0), color=colours.muted, alpha=0.22, line_alpha=0.0),
            drawn(hv.HLine(0.0), color=colours.line, line_width=1.2, line_dash="dashed"),
            _points(orbits, "pull", f"pull_{axis}", "", SERIES_COLOURS[0]),
        ],
        title=f"{_NAMES[axis]}: estimate minus fitted motion",
        subtitle=f"over the part of σ that scatters between orbits; rms {sd:.2f}; band ± 1σ",
        theme=theme,
        width=width,
        height=round(0.4 * width),
        xlim=xlim,
        ylim=(-half, half),
        xlabel=_X.label,
        ylabel="residual (σ)",
    )


def _points(rows: pd.DataFrame, column: str, y: str, label: str, colour: str) -> hv.Points:
    data = rows[["year", *_EXTRA]].assign(**{y: rows[column]})
    return drawn(
        hv.Points(data, [_X, hv.Dimension(y)], _EXTRA, label=label),
        color=colour,
        size=5,
        alpha=0.9,
        line_color=None,
        nonselection_alpha=0.2,
        tools=["hover"],
        hover_tooltips=_HOVER,
    )


def _line(rows: pd.DataFrame, name: str, y: str, colour: str) -> hv.Curve:
    label = _ZEROS[name]
    curve = hv.Curve((rows["year"], rows[f"{name}_mas"]), _X, hv.Dimension(y), label=label)
    dash = {"catalogue": "dotted", "true": "solid", "fit": "dashed"}[name]
    return drawn(curve, color=colour, line_width=1.6, line_dash=dash)


def _band(rows: pd.DataFrame, y: str, colour: str) -> list[hv.Area]:
    low, high = (rows["fit_mas"] + sign * rows["fit_sigma_mas"] for sign in (-1.0, 1.0))
    area = hv.Area((rows["year"], low, high), _X, [hv.Dimension(y), f"{y}_high"])
    return [drawn(area, color=colour, alpha=0.22, line_alpha=0.0)]


def _remarks(orbits: pd.DataFrame) -> str:
    """Return a text on the series that are not drawn; if there are none, on the band."""
    missing = []
    if orbits["catalogue_mas"].isna().all():
        missing.append("catalogue far beyond the frame")
    if orbits["true_mas"].isna().all():
        missing.append("no truth")
    if orbits["fit_mas"].isna().all():
        missing.append("no fitted motion")
    return "; ".join(missing) or "band: 1σ of the fitted motion"


def _offset_limits(rows: pd.DataFrame) -> Limits:
    sigma, band = rows["sigma_mas"].fillna(0.0), rows["fit_sigma_mas"].fillna(0.0)
    columns = [
        rows["offset_mas"] - sigma,
        rows["offset_mas"] + sigma,
        rows["fit_mas"] - band,
        rows["fit_mas"] + band,
        rows["catalogue_mas"],
        rows["true_mas"],
    ]
    return _spread(pd.concat(columns), least=1e-6)


def _spread(values: pd.Series, *, least: float) -> Limits:
    """Return limits that contain all values with a margin, at least `least` apart."""
    low, high = float(values.min()), float(values.max())
    margin = max(_MARGIN * (high - low), 0.5 * least)
    return low - margin, high + margin


def _draw(tables: SourceTables, theme: str) -> hv.Layout | hv.Overlay:
    return plot_time_series(time_series(tables.history, tables.motion), theme=theme)


SOURCE_FIGURES = (
    SourceFigure(
        "time-series",
        "Time series",
        "The estimates of all orbits against time, relative to the truth if there is one, and "
        "the residuals of the fitted motion over the noise. Good: residuals within the band for "
        "two thirds of the orbits, without a trend; the truth within the band of the fitted "
        "motion.",
        20,
        _draw,
        is_wide=True,
    ),
)
