"""One source's motion on the sky (paper, figures "result:ts:ref", "nonref" and "test")."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, Glyphs, Limits, framed, message
from plateviz.figures.glyphs import line, points
from plateviz.plots.elements.points import error_bars
from plateviz.plots.elements.style import SERIES_COLOURS
from plateviz.plots.elements.units import angle_text
from plateviz.plots.survey_figure import SourceFigure
from plateviz.plots.workspace import SourceWorkspace
from plateviz.tables.counts import orbits_text
from plateviz.tables.sky_track import TrackStatistics, sky_track_of, track_statistics
from plateviz.tables.survey_tables import SourceTables

_TITLE = "Motion on the sky"
_XLABEL, _YLABEL = "Δα cos δ (mas, East to the left)", "Δδ (mas)"
_HOVER = [
    ("source", "@{id}"),
    ("orbit", "@{orbit_id}"),
    ("epoch", "@{year}{0.000}"),
    ("measurements", "@{n_obs}"),
    ("Δα cos δ", "@{ra_mas}{0.000} ± @{sigma_ra_mas}{0.000} mas"),
    ("Δδ", "@{dec_mas}{0.000} ± @{sigma_dec_mas}{0.000} mas"),
]
_ZEROS = {
    "catalogue": "catalogue position",
    "true": "true position",
    "fit": "fitted position",
    "mean": "mean of the estimates",
}
_CURVE_COLOURS = {"catalogue": "muted", "true": SERIES_COLOURS[1], "fit": "line"}
_MARGIN = 1.12


def plot_sky_track(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the position of one source in each orbit, with truth, catalogue and fitted motion.

    Parameters
    ----------
    table : `tables.sky_track`; the catalogue is not drawn if the table leaves it out
    width : of the frame, screen pixels
    """
    if table.empty:
        text = "No orbits of this source"
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    orbits, curve = _orbits(table), table[table["kind"] == "curve"]
    xlim, ylim = _limits(table)
    first = table.iloc[0]
    return framed(
        [
            *(_curve(curve, name) for name in _CURVE_COLOURS if _has(curve, name)),
            *([_catalogue(orbits)] if _has(orbits, "catalogue") else []),
            *_estimates(orbits),
            *([_truth(orbits)] if _has(orbits, "true") else []),
        ],
        title=f"Source {first['id']}, {first['source_class']}",
        subtitle=_subtitle(first, track_statistics(table)),
        x=Axis(_XLABEL, xlim),
        y=Axis(_YLABEL, ylim),
        width=width,
        legend_columns=4,
    )


def _orbits(rows: pd.DataFrame) -> pd.DataFrame:
    # Rows of curves have no orbit, which makes the numbers of all rows floats.
    return rows[rows["kind"] == "orbit"].astype({"orbit_id": "int64"})


def _has(rows: pd.DataFrame, name: str) -> bool:
    return bool(len(rows)) and bool(rows[f"{name}_ra_mas"].notna().any())


def _curve(rows: pd.DataFrame, name: str) -> Glyphs:
    is_fit = name == "fit"
    return line(
        rows[f"{name}_ra_mas"],
        rows[f"{name}_dec_mas"],
        name=f"{name} curve",
        color=_CURVE_COLOURS[name],
        width=1.6 if is_fit else 1.0,
        dash="dashed" if is_fit else "solid",
        alpha=0.9 if is_fit else 0.6,
        label="fitted motion" if is_fit else "",
    )


def _catalogue(rows: pd.DataFrame) -> Glyphs:
    return points(
        rows,
        "catalogue_ra_mas",
        "catalogue_dec_mas",
        name="catalogue",
        color="muted",
        marker="square",
        size=9.0,
        fill_alpha=0.0,
        label="catalogue",
    )


def _truth(rows: pd.DataFrame) -> Glyphs:
    # Drawn above the estimates, which would hide the true position of a source without motion.
    return points(
        rows,
        "true_ra_mas",
        "true_dec_mas",
        name="truth",
        color=SERIES_COLOURS[1],
        marker="diamond",
        size=7.0,
        line_width=0.0,
        label="truth",
    )


def _estimates(rows: pd.DataFrame) -> list[Glyphs]:
    colour = SERIES_COLOURS[0]
    return [
        error_bars(rows, "ra_mas", "dec_mas", "sigma_ra_mas", colour, along="x"),
        error_bars(rows, "ra_mas", "dec_mas", "sigma_dec_mas", colour, along="y"),
        points(
            rows,
            "ra_mas",
            "dec_mas",
            name="estimates",
            color=colour,
            alpha=0.9,
            line_width=0.0,
            hover=_HOVER,
            label="estimate ± 1σ",
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
    at = "" if first["zero"] == "mean" else f" at J{first['origin_year']:.2f}"
    lines.append(f"origin: {_ZEROS[first['zero']]}{at}")
    if first["zero"] != "catalogue":
        lines.append(f"catalogue left out: {angle_text(first['rms_catalogue_mas'])} off (rms, 2-D)")
    return "\n".join(lines)


def _plot(tables: SourceTables) -> Figure:
    return plot_sky_track(sky_track_of(tables.track, tables.curves))


SOURCE_FIGURES = (
    SourceFigure(
        "sky-track",
        "Motion on the sky",
        "The estimated position of the source in each orbit with its marginal sigma, and the "
        "catalogue and true positions. Good: the estimates follow the truth. A common offset of "
        "a reference source is the error of its catalogue entry.",
        SourceWorkspace.MOTION,
        10,
        _plot,
        equation="position = position₀ + μ (t − t₀) + ϖ f(t), with the parallax factors f",
    ),
)
