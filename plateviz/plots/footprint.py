"""The footprint: sources and fields on the sky (paper, figure "footprint")."""

from collections.abc import Iterator

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.points import class_points
from plateviz.plots.style import FRAME_WIDTH, LABEL_SIZE, drawn, framed, message
from plateviz.plots.theme import theme_of
from plateviz.tables.footprint import footprint_fields, footprint_sources

_TITLE = "Footprint of the orbit"
_X = hv.Dimension("x_arcmin", label="Δα cos δ (arcmin, East to the left)")
_Y = hv.Dimension("y_arcmin", label="Δδ (arcmin)")
_HOVER = [
    ("source", "@{id}"),
    ("class", "@{source_class}"),
    ("measurements", "@{n_obs}"),
    ("α", "@{ra}{0.000000}°"),
    ("δ", "@{dec}{0.000000}°"),
]
_DASHES = ("solid", "dashed", "dotdash", "dotted")
# Room for the fields' names beside the outermost corners.
_MARGIN_X, _MARGIN_Y = 1.3, 1.12


def plot_footprint(
    sources: pd.DataFrame, fields: pd.DataFrame, *, theme: str = "light", width: int = FRAME_WIDTH
) -> hv.Overlay:
    """Draw the sources on the sky with the outline of every field, East to the left.

    Parameters
    ----------
    sources : `tables.footprint_sources`
    fields : `tables.footprint_fields`
    theme : "light" or "dark"
    width : of the frame, screen pixels
    """
    if sources.empty and fields.empty:
        return message(
            _TITLE, "No sources", theme=theme, width=width, xlabel=_X.label, ylabel=_Y.label
        )
    half_x = _MARGIN_X * _largest(sources["x_arcmin"], fields["x_arcmin"])
    half_y = _MARGIN_Y * _largest(sources["y_arcmin"], fields["y_arcmin"])
    points = class_points(sources, _X, _Y, hover=_HOVER, extra=["n_obs", "ra", "dec"])
    return framed(
        [*_outlines(fields, theme), points, *_names(fields, theme)],
        title=_TITLE,
        subtitle=_subtitle(sources, fields),
        theme=theme,
        width=width,
        xlim=(half_x, -half_x),
        ylim=(-half_y, half_y),
        xlabel=_X.label,
        ylabel=_Y.label,
        legend_columns=3,
    )


def _largest(*columns: pd.Series) -> float:
    values = np.abs(np.concatenate([np.asarray(c, dtype=float) for c in columns]))
    return float(values.max()) or 1.0


def _subtitle(sources: pd.DataFrame, fields: pd.DataFrame) -> str:
    counts = sources["source_class"].value_counts()
    parts = [f"{count:,} {name}" for name, count in counts.items()]
    return f"{', '.join(parts)} sources; {fields['field_id'].nunique()} fields"


def _outlines(fields: pd.DataFrame, theme: str) -> Iterator[hv.Path]:
    """Yield the detector outlines of each field, with dashes that differ between fields."""
    for number, (_, field) in enumerate(fields.groupby("field_id")):
        paths = [
            detector[["x_arcmin", "y_arcmin"]].to_numpy(dtype=float)
            for _, detector in field.groupby("detector_id")
        ]
        yield drawn(
            hv.Path(paths, [_X, _Y]),
            color=theme_of(theme).line,
            line_width=1.2,
            line_dash=_DASHES[number % len(_DASHES)],
        )


def _names(fields: pd.DataFrame, theme: str) -> Iterator[hv.Text]:
    """Yield the name of each field, outside its corner farthest from the centre."""
    for field_id, group in fields.groupby("field_id"):
        x, y = group["x_arcmin"].to_numpy(dtype=float), group["y_arcmin"].to_numpy(dtype=float)
        corner = int(np.argmax(np.hypot(x, y)))
        text = hv.Text(
            1.03 * x[corner],
            1.03 * y[corner],
            f"field {field_id}",
            halign="right" if x[corner] > 0 else "left",
            valign="bottom" if y[corner] > 0 else "top",
        )
        yield drawn(
            text,
            text_color=theme_of(theme).text,
            text_font_size=LABEL_SIZE,
            text_font_style="bold",
        )


def _draw(chosen: Chosen, theme: str) -> hv.Overlay:
    sources = footprint_sources(chosen.result)
    return plot_footprint(sources, footprint_fields(chosen.result, chosen.instrument), theme=theme)


DIAGNOSTICS = (
    Diagnostic(
        "footprint",
        "Footprint",
        "The sources on the sky, and the fields of this orbit. Good: reference sources in every "
        "field. They tie the solution to the sky; a field with few of them depends on the other "
        "fields.",
        10,
        _draw,
    ),
)
