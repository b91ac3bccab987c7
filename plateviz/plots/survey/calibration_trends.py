"""The calibration of all orbits of a run against time, with the fitted trends."""

import pandas as pd

from plateviz.figures.figure import Axis, Figure, Limits, framed, message, side_by_side
from plateviz.figures.glyphs import line, points
from plateviz.plots.elements.style import PANEL_WIDTH, SERIES_COLOURS
from plateviz.plots.elements.units import finer_unit, number_text
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.tables.calibration_trends import calibration_trends
from plateviz.tables.survey_tables import SurveyTables
from solver.results.diagnosis.survey.trends import LEAST_ORBITS
from solver.units import ARCSEC_PER_DEG

_TITLE = "Trends of the calibration"
_XLABEL, _YLABEL = "epoch (Julian year, TCB)", "value minus mean"
_NONE = (
    f"No run of {LEAST_ORBITS} orbits or more that has ended. From then on: what changes most from "
    "orbit to orbit in each group of the calibration, with its trend."
)
_HOVER = [("orbit", "@{orbit_id}"), ("value minus mean", "@{offset}{0.000} @{unit}")]
_ANGLES = {1: "angle of the first orbit", -1: "other angle", 0: "orbits"}


def plot_calibration_trends(table: pd.DataFrame, *, width: int = PANEL_WIDTH) -> Figure:
    """Draw the parameter of each group that changes most, a panel each, with its trend.

    Parameters
    ----------
    table : `tables.calibration_trends`
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        text, label = _NONE, f"{_YLABEL} (µm)"
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel=label)
    panels = [_panel(rows, str(name), width) for name, rows in table.groupby("group", sort=False)]
    return side_by_side(panels, columns=3)


def _panel(rows: pd.DataFrame, group: str, width: int) -> Figure:
    rows = _in_finer_unit(rows)
    ordered = rows.sort_values("year")
    unit = str(rows["unit"].iloc[0])
    seasons = [season for season in _ANGLES if (rows["season"] == season).any()]
    marks = [
        points(
            rows[rows["season"] == season],
            "year",
            "offset",
            name=_ANGLES[season],
            color=SERIES_COLOURS[number],
            size=5,
            hover=_HOVER,
            label=_ANGLES[season],
        )
        for number, season in enumerate(seasons)
    ]
    trend = line(
        ordered["year"].to_numpy(), ordered["trend"].to_numpy(), name="trend", color="mark"
    )
    return framed(
        [*marks, trend],
        title=f"{group[0].upper()}{group[1:]}",
        subtitle=_subtitle(rows.iloc[0], unit),
        x=Axis(_XLABEL, _spread(rows["year"], 0.04), is_grouped=False),
        y=Axis(f"{_YLABEL} ({unit})", _spread(rows["offset"], 0.12)),
        width=width,
        height=round(0.62 * width),
        legend_columns=2,
    )


def _in_finer_unit(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows in a unit in which the values are not small fractions."""
    unit, factor = str(rows["unit"].iloc[0]), 1.0
    if unit == "deg":
        unit, factor = "arcsec", ARCSEC_PER_DEG
    largest = factor * float(rows["offset"].abs().max())
    if largest > 0.0:
        unit, finer = finer_unit(largest, unit)
        factor *= finer
    values = {name: factor * rows[name] for name in ("offset", "trend", "change", "scatter")}
    return rows.assign(unit=unit, **values)


def _subtitle(first: pd.Series, unit: str) -> str:
    change, scatter = (number_text(float(first[name]), 3) for name in ("change", "scatter"))
    return (
        f"{first['label']}: change {change} {unit}\n"
        f"scatter {scatter} {unit}; trend {first['sigma']:.1f} sigma"
    )


def _spread(values: pd.Series, share: float) -> Limits:
    low, high = float(values.min()), float(values.max())
    margin = share * (high - low) or 0.5
    return low - margin, high + margin


# Three panels side by side on the page.
_PAGE_WIDTH = 270


def _plot(tables: SurveyTables) -> Figure:
    return plot_calibration_trends(calibration_trends(tables.tests), width=_PAGE_WIDTH)


SURVEY_FIGURES = (
    SurveyFigure(
        "calibration-trends",
        _TITLE,
        "The parameter of each group of the calibration that changes most from orbit to orbit, "
        "minus its mean, with the fitted trend. Of the detectors, without what all have in "
        "common. Good: scatter without a trend; below three sigma, the largest of many is chance.",
        SurveyWorkspace.ACCURACY,
        62,
        _plot,
        is_wide=True,
        least_height=300,
        narrow_height=470,
        column_height=980,
        takes_row=True,
        equation="value − mean; the line is fitted with a step between the position angles",
    ),
)
