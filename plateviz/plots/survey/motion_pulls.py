"""Pulls of the fitted motions, a panel per parameter."""

import pandas as pd

from plateviz.figures.figure import Axis, Figure, framed, message, side_by_side
from plateviz.plots.elements.points import steps, unit_normal
from plateviz.plots.elements.style import PANEL_WIDTH, SERIES_COLOURS
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.tables.motion_pulls import CHI2, LEAST_ORBITS, motion_pulls
from plateviz.tables.rounded import with_minus_signs
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "Pulls of the fitted motions"
_NAMES = {
    "ra": "α cos δ",
    "dec": "δ",
    "parallax": "Parallax",
    "pmra": "Proper motion in α cos δ",
    "pmdec": "Proper motion in δ",
    CHI2: "χ² of the motion fit",
}
_PULL = "(fitted minus true) / σ"
_DEPARTURE = "(χ² − dof) / √(2 dof)"
_YLABEL = "sources per bin"


def plot_motion_pulls(table: pd.DataFrame, *, width: int = PANEL_WIDTH) -> Figure:
    """Draw the histogram of the pulls of each motion parameter with the unit normal.

    Parameters
    ----------
    table : `tables.motion_pulls`
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        text = (
            f"No source in {LEAST_ORBITS} orbits or more yet. From then on: histograms of fitted "
            "minus true position, parallax and proper motion over σ."
        )
        return message(_TITLE, text, width=width, xlabel=_PULL, ylabel=_YLABEL)
    panels = [
        _panel(rows, str(name), width) for name, rows in table.groupby("parameter", sort=False)
    ]
    return side_by_side(panels, columns=3)


def _panel(rows: pd.DataFrame, name: str, width: int) -> Figure:
    first = rows.iloc[0]
    limit = float(rows["right"].max())
    normal = unit_normal(float(first["n"] * (first["right"] - first["left"])), limit)
    top = 1.1 * max(float(rows["count"].max()), float(normal.values("y").max()))
    return framed(
        [steps(rows, "sources", SERIES_COLOURS[0]), normal],
        title=_NAMES[name],
        subtitle=_subtitle(first, limit),
        x=Axis(_DEPARTURE if name == CHI2 else _PULL, (-limit, limit)),
        y=Axis(_YLABEL, (0.0, top)),
        width=width,
        height=round(0.62 * width),
        legend_columns=2,
    )


def _subtitle(first: pd.Series, limit: float) -> str:
    mean = with_minus_signs(f"{first['mean']:.3f}")
    return (
        f"sd {first['sd']:.3f}, mean {mean}\n"
        f"n = {first['n']:,}; {first['outside']:,} beyond ± {limit:g}"
    )


# Three panels side by side on the page.
_PAGE_WIDTH = 270


def _plot(tables: SurveyTables) -> Figure:
    return plot_motion_pulls(motion_pulls(tables.motions), width=_PAGE_WIDTH)


SURVEY_FIGURES = (
    SurveyFigure(
        "motion-pulls",
        "Pulls of the fitted motions",
        "Fitted minus true position, parallax and proper motion over their sigmas, for "
        f"non-reference sources in at least {LEAST_ORBITS} orbits. Good: the unit normal. Sources "
        "of one region share the reference sources' errors, so that the mean may differ from "
        "zero; the width should be one.",
        SurveyWorkspace.ACCURACY,
        60,
        _plot,
        is_wide=True,
        least_height=300,
        column_height=680,
        takes_row=True,
        equation="(fitted − true) / σ, for position, parallax and proper motion",
    ),
)
