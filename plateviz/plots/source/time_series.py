"""One source's offsets in each coordinate against time, and their residuals."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import Axis, Figure, Glyphs, Limits, framed, message, side_by_side
from plateviz.figures.glyphs import band, horizontal, line, points, strip
from plateviz.plots.elements.points import error_bars
from plateviz.plots.elements.style import PANEL_WIDTH, SERIES_COLOURS
from plateviz.plots.survey_figure import SourceFigure
from plateviz.plots.workspace import SourceWorkspace
from plateviz.tables.counts import orbits_text
from plateviz.tables.labels import short_id
from plateviz.tables.survey_tables import SourceTables
from plateviz.tables.time_series import series_of

_TITLE = "Time series"
_XLABEL = "epoch (Julian year, TCB)"
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
_LINE_COLOURS = {"catalogue": "muted", "true": SERIES_COLOURS[1], "fit": "line"}
_DASHES = {"catalogue": "dotted", "true": "solid", "fit": "dashed"}
_LEAST_PULL = 3.5
_MARGIN = 0.06


def plot_time_series(table: pd.DataFrame, *, width: int = PANEL_WIDTH) -> Figure:
    """Draw the offsets of one source against time, a panel per coordinate, linked in time.

    If the motion was fitted, panels below show the residuals over the noise of each orbit.

    Parameters
    ----------
    table : `tables.time_series`
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        text = "No orbits of this source"
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel="offset (mas)")
    parts = [(axis, table[table["coordinate"] == axis]) for axis in _NAMES]
    xlim = _spread(table["year"], least=1.0)
    panels = [_offsets(rows, axis, xlim, width) for axis, rows in parts]
    if table["pull"].notna().any():
        panels += [_residuals(rows, axis, xlim, width) for axis, rows in parts]
    return side_by_side(panels, columns=2, linked="x")


def _offsets(rows: pd.DataFrame, axis: str, xlim: Limits, width: int) -> Figure:
    orbits, curve = _orbits(rows), rows[rows["kind"] == "curve"]
    zero = str(rows["zero"].iloc[0])
    known = [name for name in _LINE_COLOURS if curve[f"{name}_mas"].notna().any()]
    return framed(
        [
            *([_band(curve)] if "fit" in known else []),
            horizontal(0.0, name="zero", width=1.0, dash="solid", alpha=0.6),
            *(_line(curve, name) for name in known),
            error_bars(orbits, "year", "offset_mas", "sigma_mas", SERIES_COLOURS[0]),
            _points(orbits, "offset_mas", "estimate ± 1σ"),
        ],
        title=f"{_NAMES[axis]} of source {short_id(orbits['id'].iloc[0])}",
        subtitle=f"{orbits_text(len(orbits))}; {_remarks(orbits)}",
        x=Axis(_XLABEL, xlim, is_grouped=False),
        y=Axis(f"{_NAMES[axis]} minus {_ZEROS[zero]} (mas)", _offset_limits(rows)),
        width=width,
        height=round(0.62 * width),
        legend_columns=4,
    )


def _residuals(rows: pd.DataFrame, axis: str, xlim: Limits, width: int) -> Figure:
    orbits = _orbits(rows)
    half = 1.1 * max(_LEAST_PULL, float(orbits["pull"].abs().max()))
    sd = float(np.sqrt(np.mean(orbits["pull"] ** 2)))
    return framed(
        [
            strip(-1.0, 1.0, name="one sigma"),
            horizontal(0.0, name="zero"),
            _points(orbits, "pull"),
        ],
        title=f"{_NAMES[axis]}: estimate minus fitted motion",
        subtitle=f"over the part of σ that scatters between orbits; rms {sd:.2f}; band ± 1σ",
        x=Axis(_XLABEL, xlim, is_grouped=False),
        y=Axis("residual (σ)", (-half, half)),
        width=width,
        height=round(0.4 * width),
    )


def _orbits(rows: pd.DataFrame) -> pd.DataFrame:
    # Rows of curves have no orbit, which makes the numbers of all rows floats.
    return rows[rows["kind"] == "orbit"].astype({"orbit_id": "int64"})


def _points(rows: pd.DataFrame, column: str, label: str = "") -> Glyphs:
    return points(
        rows,
        "year",
        column,
        name="estimates",
        color=SERIES_COLOURS[0],
        alpha=0.9,
        line_width=0.0,
        hover=_HOVER,
        label=label,
    )


def _line(rows: pd.DataFrame, name: str) -> Glyphs:
    return line(
        rows["year"],
        rows[f"{name}_mas"],
        name=name,
        color=_LINE_COLOURS[name],
        dash=_DASHES[name],
        label=_ZEROS[name],
    )


def _band(rows: pd.DataFrame) -> Glyphs:
    low, high = (rows["fit_mas"] + sign * rows["fit_sigma_mas"] for sign in (-1.0, 1.0))
    return band(rows["year"], low, high, name="band")


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


def _plot(tables: SourceTables) -> Figure:
    return plot_time_series(series_of(tables.track, tables.curves))


SOURCE_FIGURES = (
    SourceFigure(
        "time-series",
        "Time series",
        "The estimates of all orbits against time, relative to the truth if there is one, and "
        "the residuals of the fitted motion over the noise. Good: residuals within the band for "
        "two thirds of the orbits, without a trend; the truth within the band of the fitted "
        "motion.",
        SourceWorkspace.MOTION,
        20,
        _plot,
        is_wide=True,
        column_height=600,
        equation=(
            "offset = q₀ + μ (t − t₀) + ϖ f(t), with the parallax factors f; residual = "
            "(estimate − fit) / σ(noise)"
        ),
    ),
)
