"""Smooth errors of the catalogue as vectors on the sky."""

import pandas as pd

from plateviz.figures.figure import Axis, Figure, framed, message
from plateviz.plots.elements.arrows import Field, arrows, key, round_125
from plateviz.plots.elements.style import PANEL_WIDTH
from plateviz.plots.elements.units import angle_text
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.tables.survey_tables import SurveyTables
from plateviz.tables.zonal_errors import ZonalStatistics, zonal_errors, zonal_statistics

_TITLE = "Smooth errors of the catalogue"
_XLABEL, _YLABEL = "east of the centre (deg)", "north (deg)"
_HOVER = [
    ("at", "@{east_deg}{0.00}° east, @{north_deg}{0.00}° north"),
    ("Δα cos δ", "@{error_ra_mas}{0.000} mas, by chance ± @{sigma_ra_mas}{0.000}"),
    ("Δδ", "@{error_dec_mas}{0.000} mas, by chance ± @{sigma_dec_mas}{0.000}"),
]
_MARGIN = 1.15
# Length of a field that can just be seen, as a share of the frame's width.
_TYPICAL_SHARE = 0.045
# Of the scatter of chi2, by which it exceeds its expectation before the field is given an rms.
_LIMIT = 3.0


def plot_zonal_errors(
    zonal: pd.DataFrame, *, arrow_scale: float | None = None, width: int = PANEL_WIDTH
) -> Figure:
    """Draw the most likely field of smooth errors, catalogue minus sky, east to the left.

    Parameters
    ----------
    zonal : `run_schema.ZONAL_FIELD`
    arrow_scale : drawn length over error, deg mas^-1; None for that of the field alone
    width : of the frame, screen pixels
    """
    if zonal.empty:
        text = "No test for smooth errors: it is made at the end of a run of eight or more orbits"
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    table, found = zonal_errors(zonal), zonal_statistics(zonal)
    vectors = table.assign(
        x=table["east_deg"],
        y=table["north_deg"],
        u=table["error_ra_mas"],
        v=table["error_dec_mas"],
    )
    area = _area(zonal)
    scale = arrow_scale or _scale(zonal)
    length = round_125(2.0 * _TYPICAL_SHARE * area.width / scale)
    area = area.holding(vectors, scale)
    return framed(
        [
            *arrows(vectors, scale=scale, field=area, colour="mark", hover=_HOVER),
            *key(length, angle_text(length), scale=scale, field=area),
        ],
        title=_TITLE,
        subtitle=_subtitle(found),
        x=Axis(_XLABEL, area.x),
        y=Axis(_YLABEL, area.ylim),
        width=width,
    )


def _area(zonal: pd.DataFrame) -> Field:
    half = _MARGIN * float(zonal[["half_ra", "half_dec"]].to_numpy().max())
    return Field((half, -half), (-half, half))


def _scale(zonal: pd.DataFrame) -> float:
    """Return the scale of what can be seen: a field that is mere chance has short arrows."""
    found = zonal_statistics(zonal)
    return round_125(_TYPICAL_SHARE * _area(zonal).width / max(found.typical_mas, found.rms_mas))


def _subtitle(found: ZonalStatistics) -> str:
    is_more = found.chi2 > found.dof + _LIMIT * found.scatter
    size = f"rms {angle_text(found.rms_mas)}" if is_more else "as by chance"
    return (
        f"χ² {found.chi2:.0f}, expected {found.dof:.0f} ± {found.scatter:.0f}: {size}\n"
        f"an rms of {angle_text(found.typical_mas)} would be seen in half of such runs"
    )


def _plot(tables: SurveyTables) -> Figure:
    both = [tables, *([tables.other] if tables.other else [])]
    scales = [_scale(one.tests.zonal) for one in both if not one.tests.zonal.empty]
    return plot_zonal_errors(tables.tests.zonal, arrow_scale=min(scales, default=None))


SURVEY_FIGURES = (
    SurveyFigure(
        "zonal-errors",
        _TITLE,
        "The most likely field of errors that neighbouring reference stars share, catalogue minus "
        "sky, from all orbits together. No single orbit shows it, because its calibration follows "
        "the catalogue; orbits at other places and position angles do so differently. What no "
        "orbit can show, such as a shift of the whole catalogue, is not in it. Good: χ² within "
        "three times its scatter; the arrows are chance then.",
        SurveyWorkspace.CATALOGUE,
        15,
        _plot,
        equation=(
            "polynomial of degree 3 on the sky, fitted to the deviations of the reference stars, "
            "the frames of the orbits and their quadratic distortion"
        ),
    ),
)
