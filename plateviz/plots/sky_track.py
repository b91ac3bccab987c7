"""One source's motion on the sky (paper, figures "result:ts:ref", "nonref" and "test")."""

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.points import error_bars
from plateviz.plots.style import (
    FRAME_WIDTH,
    SERIES_COLOURS,
    AxisLabels,
    Limits,
    drawn,
    framed,
    message,
)
from plateviz.plots.survey_figure import SourceFigure
from plateviz.plots.theme import theme_of
from plateviz.plots.units import angle_text, orbits_text
from plateviz.tables.sky_track import TrackStatistics, sky_track, track_statistics
from plateviz.tables.survey_tables import SourceTables

_TITLE = "Motion on the sky"
_LABELS: AxisLabels = {"xlabel": "Δα cos δ (mas, East to the left)", "ylabel": "Δδ (mas)"}
_X, _Y = hv.Dimension("ra_mas"), hv.Dimension("dec_mas")
_HOVER = [
    ("source", "@{id}"),
    ("orbit", "@{orbit_id}"),
    ("epoch", "@{year}{0.000}"),
    ("measurements", "@{n_obs}"),
    ("Δα cos δ", "@{ra_mas}{0.000} ± @{sigma_ra_mas}{0.000} mas"),
    ("Δδ", "@{dec_mas}{0.000} ± @{sigma_dec_mas}{0.000} mas"),
]
_EXTRA = ["id", "orbit_id", "year", "n_obs", "sigma_ra_mas", "sigma_dec_mas"]
_ZEROS = {
    "catalogue": "catalogue position",
    "true": "true position",
    "fit": "fitted position",
    "mean": "mean of the estimates",
}
_MARGIN = 1.12


def plot_sky_track(
    table: pd.DataFrame, *, theme: str = "light", width: int = FRAME_WIDTH
) -> hv.Overlay:
    """Draw the position of one source in each orbit, with truth, catalogue and fitted motion.

    Parameters
    ----------
    table : `tables.sky_track`; the catalogue is not drawn if the table leaves it out
    theme : "light" or "dark"
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No orbits of this source", theme=theme, width=width, **_LABELS)
    orbits, curve = table[table["kind"] == "orbit"], table[table["kind"] == "curve"]
    xlim, ylim = _limits(table)
    colours = theme_of(theme)
    line = {"catalogue": colours.muted, "true": SERIES_COLOURS[1], "fit": colours.line}
    first = table.iloc[0]
    return framed(
        [
            *(_curve(curve, name, line[name]) for name in line if _has(curve, name)),
            *(_catalogue(orbits, theme) if _has(orbits, "catalogue") else []),
            *_estimates(orbits),
            *(_truth(orbits) if _has(orbits, "true") else []),
        ],
        title=f"Source {first['id']}, {first['source_class']}",
        subtitle=_subtitle(first, track_statistics(table)),
        theme=theme,
        width=width,
        xlim=xlim,
        ylim=ylim,
        legend_columns=4,
        **_LABELS,
    )


def _has(rows: pd.DataFrame, name: str) -> bool:
    return bool(len(rows)) and bool(rows[f"{name}_ra_mas"].notna().any())


def _curve(rows: pd.DataFrame, name: str, colour: str) -> hv.Curve:
    label = "fitted motion" if name == "fit" else ""
    data = (rows[f"{name}_ra_mas"], rows[f"{name}_dec_mas"])
    dash = "dashed" if name == "fit" else "solid"
    return drawn(
        hv.Curve(data, _X, _Y, label=label),
        color=colour,
        line_width=1.6 if name == "fit" else 1.0,
        line_dash=dash,
        alpha=0.9 if name == "fit" else 0.6,
        show_legend=name == "fit",
    )


def _catalogue(rows: pd.DataFrame, theme: str) -> list[hv.Points]:
    data = (rows["catalogue_ra_mas"], rows["catalogue_dec_mas"])
    points = hv.Points(data, [_X, _Y], label="catalogue")
    line = theme_of(theme).muted
    return [drawn(points, marker="square", size=9, fill_alpha=0.0, line_color=line)]


def _truth(rows: pd.DataFrame) -> list[hv.Points]:
    # Drawn above the estimates, which would hide the true position of a source without motion.
    points = hv.Points((rows["true_ra_mas"], rows["true_dec_mas"]), [_X, _Y], label="truth")
    return [drawn(points, color=SERIES_COLOURS[1], marker="diamond", size=7, line_color=None)]


def _estimates(rows: pd.DataFrame) -> list[hv.Element]:
    colour = SERIES_COLOURS[0]
    points = hv.Points(rows, [_X, _Y], _EXTRA, label="estimate ± 1σ")
    return [
        error_bars(rows, "ra_mas", "dec_mas", "sigma_ra_mas", colour, along="x"),
        error_bars(rows, "ra_mas", "dec_mas", "sigma_dec_mas", colour, along="y"),
        drawn(
            points,
            color=colour,
            size=5,
            alpha=0.9,
            line_color=None,
            nonselection_alpha=0.2,
            tools=["hover"],
            hover_tooltips=_HOVER,
        ),
    ]


def _limits(table: pd.DataFrame) -> tuple[Limits, Limits]:
    """Return the limits of a square that contains every element, East to the left."""
    ends = []
    for axis in ("ra", "dec"):
        sigma = table[f"sigma_{axis}_mas"].fillna(0.0)
        others = table[[f"{name}_{axis}_mas" for name in ("catalogue", "true", "fit")]]
        low, high = table[f"{axis}_mas"] - sigma, table[f"{axis}_mas"] + sigma
        columns = pd.concat([low, high, others], axis=1)
        ends.append((float(np.nanmin(columns)), float(np.nanmax(columns))))
    half = 0.5 * _MARGIN * (max(high - low for low, high in ends) or 1.0)
    x, y = (0.5 * (low + high) for low, high in ends)
    return (x + half, x - half), (y - half, y + half)


def _subtitle(first: pd.Series, statistics: TrackStatistics) -> str:
    """Return up to three lines: orbits and separation, the origin, and a catalogue left out."""
    ra, dec, both = (angle_text(rms) for rms in statistics[1:])
    separation = f"rms from the truth {ra} (α), {dec} (δ), {both} (2-D)"
    has_truth = np.isfinite(statistics.rms_2d)
    lines = [f"{orbits_text(statistics.n)}; {separation if has_truth else 'no truth'}"]
    at = "" if first["zero"] == "mean" else f" at J{first['mean_year']:.2f}"
    lines.append(f"origin: {_ZEROS[first['zero']]}{at}")
    if first["zero"] != "catalogue":
        lines.append(f"catalogue left out: {angle_text(first['rms_catalogue_mas'])} off (rms, 2-D)")
    return "\n".join(lines)


def _draw(tables: SourceTables, theme: str) -> hv.Overlay:
    return plot_sky_track(sky_track(tables.history, tables.motion), theme=theme)


SOURCE_FIGURES = (
    SourceFigure(
        "sky-track",
        "Motion on the sky",
        "The estimated position of the source in each orbit with its marginal sigma, and the "
        "catalogue and true positions. Good: the estimates follow the truth. A common offset of "
        "a reference source is the error of its catalogue entry.",
        10,
        _draw,
    ),
)
