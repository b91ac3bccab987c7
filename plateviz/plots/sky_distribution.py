"""Sources of the catalogue in Galactic coordinates (paper, figure "exp:source")."""

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.points import class_points
from plateviz.plots.style import (
    PANEL_WIDTH,
    AxisLabels,
    Limits,
    drawn,
    framed,
    message,
    side_by_side,
)
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.theme import theme_of
from plateviz.tables.sky_distribution import sky_density, sky_distribution
from plateviz.tables.sources import CLASSES
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "Sources in the sky"
_LABELS: AxisLabels = {"xlabel": "l (deg)", "ylabel": "b (deg)"}
_X, _Y = hv.Dimension("l_deg"), hv.Dimension("b_deg")
_HOVER = [("source", "@{id}"), ("l", "@{l_deg}{0.0000}°"), ("b", "@{b_deg}{0.0000}°")]
_MARGIN = 0.04
# Number of points above which the density is drawn, because points would overlap.
_POINT_LIMIT = 500


def plot_sky_distribution(
    table: pd.DataFrame,
    *,
    area: tuple[Limits, Limits] | None = None,
    target: tuple[float, float] | None = None,
    theme: str = "light",
    width: int = PANEL_WIDTH,
) -> hv.Layout | hv.Overlay:
    """Draw the sources in Galactic coordinates, l increasing to the left, a panel per class.

    A class with more than 500 sources is drawn as its number per square arcmin.

    Parameters
    ----------
    table : `tables.sky_distribution`
    area : Galactic longitudes and latitudes between which the fields lie, deg
    target : Galactic longitude and latitude of the survey's target, deg
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No sources", theme=theme, width=width, **_LABELS)
    xlim, ylim = _limits(table, area)
    panels = []
    for name in (name for name in reversed(CLASSES) if (table["source_class"] == name).any()):
        rows = table[table["source_class"] == name]
        is_dense = len(rows) > _POINT_LIMIT
        sources = _density(rows, theme) if is_dense else _points(rows)
        panels.append(
            framed(
                [sources, *_outline(area, theme), *_cross(target, theme)],
                title=f"{name.capitalize()} sources",
                subtitle=_subtitle(rows, is_dense, area, target),
                theme=theme,
                width=width,
                xlim=xlim,
                ylim=ylim,
                # Linked panels sort their limits, so reversed limits would have no effect.
                invert_xaxis=True,
                **_LABELS,
            )
        )
    return side_by_side(panels, columns=3, linked=True)


def _points(rows: pd.DataFrame) -> hv.Points:
    return class_points(rows, _X, _Y, hover=_HOVER, extra=[])


def _density(rows: pd.DataFrame, theme: str) -> hv.Image:
    cells = sky_density(rows).pivot(index="b_deg", columns="l_deg", values="density")
    l_deg, b_deg = cells.columns.to_numpy(dtype=float), cells.index.to_numpy(dtype=float)
    image = hv.Image((l_deg, b_deg, cells.to_numpy()), [_X, _Y], "density")
    return drawn(
        image,
        cmap=theme_of(theme).count_palette,
        clim=(0.0, float(np.nanmax(cells.to_numpy()))),
        clipping_colors={"NaN": "transparent"},
        colorbar=True,
        clabel=" ",
        colorbar_opts={"width": 8},
        tools=["hover"],
        hover_tooltips=[
            ("l", "@{l_deg}{0.00}°"),
            ("b", "@{b_deg}{0.00}°"),
            ("density", "@{density}{0.00} per arcmin²"),
        ],
    )


def _outline(area: tuple[Limits, Limits] | None, theme: str) -> list[hv.Path]:
    if area is None:
        return []
    (left, right), (low, high) = area
    corners = [(left, low), (right, low), (right, high), (left, high), (left, low)]
    line = theme_of(theme).text
    return [drawn(hv.Path([corners], [_X, _Y]), color=line, line_width=1.4, line_dash="dashed")]


def _cross(target: tuple[float, float] | None, theme: str) -> list[hv.Points]:
    if target is None:
        return []
    points = hv.Points([target], [_X, _Y])
    line = theme_of(theme).text
    return [drawn(points, marker="cross", size=16, color=line, line_width=2.0)]


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


def _draw(tables: SurveyTables, theme: str) -> hv.Layout | hv.Overlay:
    return plot_sky_distribution(
        sky_distribution(tables.catalogue, tables.truth),
        area=tables.area,
        target=tables.target,
        theme=theme,
        width=_PAGE_WIDTH,
    )


SURVEY_FIGURES = (
    SurveyFigure(
        "sky-distribution",
        "Sources in the sky",
        "The sources of the catalogue in Galactic coordinates, by class. Good: reference sources "
        "over the whole area, because the solution of an orbit is tied to the sky by those in "
        "its fields. Artificial sources lie about the target.",
        10,
        _draw,
        is_wide=True,
    ),
)
