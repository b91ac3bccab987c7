"""The footprint: sources and fields on the sky (paper, figure "footprint")."""

from itertools import cycle

import numpy as np
import pandas as pd

from plateviz.figures.figure import (
    FRAME_WIDTH,
    HANDLES,
    Axis,
    By,
    Figure,
    Glyphs,
    framed,
    message,
)
from plateviz.figures.glyphs import paths, texts
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.focal_plane import of_detectors
from plateviz.plots.elements.points import class_points
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.footprint import footprint_fields, footprint_sources
from solver.data.plural import plural

_TITLE = "Footprint of the orbit"
_XLABEL, _YLABEL = "Δα cos δ (arcmin, East to the left)", "Δδ (arcmin)"
_HOVER = [
    ("source", "@{id}"),
    ("class", "@{source_class}"),
    ("measurements", "@{n_obs}"),
    ("α", "@{ra}{0.000000}°"),
    ("δ", "@{dec}{0.000000}°"),
]
_DASHES = ("solid", "dashed", "dotdash", "dotted")
# Colour and width, in screen pixels, of what is tapped.
_UNSEEN, _FINGER = "#00000000", 9.0
# Room for the fields' numbers beside the outermost corners.
_MARGIN_X, _MARGIN_Y = 1.25, 1.2


def plot_footprint(
    sources: pd.DataFrame, fields: pd.DataFrame, *, width: int = FRAME_WIDTH
) -> Figure:
    """Draw the sources on the sky with the outline of every field, East to the left.

    Parameters
    ----------
    sources : `tables.footprint_sources`
    fields : `tables.footprint_fields`
    width : of the frame, screen pixels
    """
    if sources.empty and fields.empty:
        return message(_TITLE, "No sources", width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    half_x = _MARGIN_X * _largest(sources["x_arcmin"], fields["x_arcmin"])
    half_y = _MARGIN_Y * _largest(sources["y_arcmin"], fields["y_arcmin"])
    points = class_points(sources, "x_arcmin", "y_arcmin", hover=_HOVER)
    return framed(
        [*_outlines(fields), points, _field_numbers(fields)],
        title=_TITLE,
        subtitle=_subtitle(sources, fields),
        x=Axis(_XLABEL, (half_x, -half_x)),
        y=Axis(_YLABEL, (-half_y, half_y)),
        width=width,
        legend_columns=3,
    )


def _largest(*columns: pd.Series) -> float:
    values = np.abs(np.concatenate([np.asarray(c, dtype=float) for c in columns]))
    return float(values.max()) or 1.0


def _subtitle(sources: pd.DataFrame, fields: pd.DataFrame) -> str:
    counts = sources["source_class"].value_counts()
    parts = [f"{count:,} {name}" for name, count in counts.items()]
    return f"{', '.join(parts)} {plural(len(sources), 'source')}; fields {_listed(fields)}"


def _listed(fields: pd.DataFrame) -> str:
    return ", ".join(f"{field:.0f}" for field in sorted(fields["field_id"].unique()))


def _outlines(fields: pd.DataFrame) -> list[Glyphs]:
    """Return the detector outlines of each field, with dashes that differ between fields.

    A line is too thin for a finger: what is tapped is a wide one, which is not seen.
    """
    corners = fields[["x_arcmin", "y_arcmin"]].to_numpy(dtype=float)
    dash = dict(zip(sorted(fields["field_id"].unique()), cycle(_DASHES), strict=False))
    groups = sorted(fields.groupby(["field_id", "detector_id"]).indices.items())
    outlines = [corners[rows] for _, rows in groups]
    dashes = [dash[field] for (field, _), _ in groups]
    ids = [detector_id for (_, detector_id), _ in groups]
    lines = paths(outlines, name="outlines", color="line", width=1.2, dashes=dashes)
    handles = paths(outlines, name=HANDLES, color=_UNSEEN, width=_FINGER)
    return [of_detectors(one, ids) for one in (lines, handles)]


def _field_numbers(fields: pd.DataFrame) -> Glyphs:
    """Return the number of each field, outside the corner that is farthest from all others."""
    numbers, places = [], [np.zeros(2)]
    for number, field in fields.groupby("field_id"):
        corners = field[["x_arcmin", "y_arcmin"]].to_numpy(dtype=float)
        to_others = np.hypot(*(corners[:, None] - np.array(places)).transpose(2, 0, 1))
        places.append(corners[to_others.min(axis=1).argmax()])
        numbers.append(f"{number:.0f}")
    x, y = np.array(places[1:]).reshape(-1, 2).T
    return texts(
        1.03 * x,
        1.03 * y,
        numbers,
        name="field numbers",
        size="13px",
        is_bold=True,
        align=By("side", {"left": "right", "right": "left"}),
        baseline=By("end", {"top": "bottom", "bottom": "top"}),
        keep={
            "side": np.where(x > 0, "left", "right").astype(object),
            "end": np.where(y > 0, "top", "bottom").astype(object),
        },
    )


def _plot(chosen: Chosen) -> Figure:
    sources = footprint_sources(chosen.result)
    return plot_footprint(sources, footprint_fields(chosen.result, chosen.instrument))


DIAGNOSTICS = (
    Diagnostic(
        "footprint",
        "Footprint",
        "The sources on the sky, and the fields of this orbit. Good: reference sources in every "
        "field. They tie the solution to the sky; a field with few of them depends on the other "
        "fields.",
        OrbitWorkspace.SKY,
        10,
        _plot,
        is_key=True,
        equation="x = Δα cos δ, y = Δδ from the centre of the field of the orbit",
    ),
)
