"""Sources of the catalogue in Galactic coordinates (paper, figure "exp:source")."""

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
from plateviz.figures.glyphs import image, paths, points
from plateviz.plots.elements.points import class_points
from plateviz.plots.elements.style import PANEL_WIDTH
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.tables.sky_distribution import sky_density, sky_distribution
from plateviz.tables.sources import CLASSES
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "Sources in the sky"
_XLABEL, _YLABEL = "l (deg)", "b (deg)"
_HOVER = [("source", "@{id}"), ("l", "@{l_deg}{0.0000}°"), ("b", "@{b_deg}{0.0000}°")]
_HOVER_DENSITY = [
    ("l", "$x{0.00}°"),
    ("b", "$y{0.00}°"),
    ("density", "@{density}{0.00} per arcmin²"),
]
_MARGIN = 0.04
# Number of points above which the density is drawn, because points would overlap.
_POINT_LIMIT = 500


def plot_sky_distribution(
    table: pd.DataFrame,
    *,
    area: tuple[Limits, Limits] | None = None,
    target: tuple[float, float] | None = None,
    width: int = PANEL_WIDTH,
) -> Figure:
    """Draw the sources in Galactic coordinates, l increasing to the left, a panel per class.

    A class with more than 500 sources is drawn as its number per square arcmin.

    Parameters
    ----------
    table : `tables.sky_distribution`
    area : Galactic longitudes and latitudes between which the fields lie, deg
    target : Galactic longitude and latitude of the survey's target, deg
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No sources", width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    xlim, ylim = _limits(table, area)
    panels = []
    for name in (name for name in reversed(CLASSES) if (table["source_class"] == name).any()):
        rows = table[table["source_class"] == name]
        is_dense = len(rows) > _POINT_LIMIT
        sources = _density(rows) if is_dense else _points(rows)
        panels.append(
            framed(
                [sources, *_outline(area), *_cross(target)],
                title=f"{name.capitalize()} sources",
                subtitle=_subtitle(rows, is_dense, area, target),
                x=Axis(_XLABEL, (xlim[1], xlim[0])),
                y=Axis(_YLABEL, ylim),
                width=width,
            )
        )
    return side_by_side(panels, columns=3, linked="xy")


def _points(rows: pd.DataFrame) -> Glyphs:
    return class_points(rows, "l_deg", "b_deg", hover=_HOVER)


def _density(rows: pd.DataFrame) -> Glyphs:
    cells = sky_density(rows).pivot(index="b_deg", columns="l_deg", values="density")
    most = float(np.nanmax(cells.to_numpy()))
    return image(
        cells.to_numpy(),
        _edges(cells.columns, rows["l_deg"]),
        _edges(cells.index, rows["b_deg"]),
        name="density",
        ramp=Ramp("density", "count", (0.0, most), label=""),
        hover=_HOVER_DENSITY,
    )


def _edges(centres: pd.Index, values: pd.Series) -> Limits:
    """Return the outer edges of the cells, which begin at the lowest value."""
    low = float(values.min())
    return low, float(centres[-1]) + (float(centres[0]) - low)


def _outline(area: tuple[Limits, Limits] | None) -> list[Glyphs]:
    if area is None:
        return []
    (left, right), (low, high) = area
    corners = [(left, low), (right, low), (right, high), (left, high), (left, low)]
    return [paths([np.array(corners)], name="area", color="text", width=1.4, dashes="dashed")]


def _cross(target: tuple[float, float] | None) -> list[Glyphs]:
    if target is None:
        return []
    at = {"x": target[:1], "y": target[1:]}
    return [
        points(at, "x", "y", name="target", color="text", marker="cross", size=16.0, line_width=2.0)
    ]


def _limits(table: pd.DataFrame, area: tuple[Limits, Limits] | None) -> tuple[Limits, Limits]:
    """Return limits that contain all sources and the area of the fields."""
    (left, right), (low, high) = (
        (
            min([float(table[name].min()), *around]),
            max([float(table[name].max()), *around]),
        )
        for name, around in zip(("l_deg", "b_deg"), area or ((), ()), strict=True)
    )
    margin = _MARGIN * max(right - left, high - low) or 1.0
    return (left - margin, right + margin), (low - margin, high + margin)


def _subtitle(
    rows: pd.DataFrame,
    is_dense: bool,
    area: tuple[Limits, Limits] | None,
    target: tuple[float, float] | None,
) -> str:
    what = "colour: number per arcmin²" if is_dense else "one mark each"
    guides = {"dashed: the fields' area": area, "cross: the target": target}
    shown = "; ".join(guide for guide, at in guides.items() if at)
    plural = "" if len(rows) == 1 else "s"
    return f"{len(rows):,} source{plural}; {what}\n{shown}".strip()


# Three classes side by side on the page, two of them with a colour bar.
_PAGE_WIDTH = 250


def _plot(tables: SurveyTables) -> Figure:
    return plot_sky_distribution(
        sky_distribution(tables.catalogue, tables.truth),
        area=tables.area,
        target=tables.target,
        width=_PAGE_WIDTH,
    )


SURVEY_FIGURES = (
    SurveyFigure(
        "sky-distribution",
        "Sources in the sky",
        "The sources of the catalogue in Galactic coordinates, by class. Good: reference sources "
        "over the whole area, because the solution of an orbit is tied to the sky by those in "
        "its fields. Artificial sources lie about the target.",
        SurveyWorkspace.CATALOGUE,
        10,
        _plot,
        is_wide=True,
        equation="l, b: Galactic longitude and latitude",
        narrow_height=520,
        is_of_run=False,
    ),
)
