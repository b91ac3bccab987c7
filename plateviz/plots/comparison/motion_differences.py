"""Differences between the motions that two runs fitted, over their uncertainty."""

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
from plateviz.figures.glyphs import horizontal, image
from plateviz.plots.elements.points import class_points
from plateviz.plots.elements.style import PANEL_WIDTH, ROW_LIMIT
from plateviz.plots.elements.units import angle_text, number_text
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.tables.motion_differences import PARAMETER_NAMES, motion_differences, shared_motions
from plateviz.tables.survey_tables import SurveyTables

_TITLE = "Motions of two runs"
_NONE = "No source has a fitted motion in both runs; motions are fitted after the last orbit."
_XLABEL = "number of orbits N"
_DIFFERENCE, _RATIO = "(B minus A) / larger σ", "σ of B / σ of A"
_RATIO_OF = "parallax"
_HOVER_POINT = [("source", "@{id}"), ("orbits", "@{n_orbits}")]
_HOVER_CELL = [("orbits", "$x{0}"), ("value", "$y{0.00}"), ("sources", "@{count}")]
# Rows of cells in a frame; most columns.
_ROWS, _MOST_COLUMNS = 60, 100
# Width of the strip of points of one number of orbits, and the share of it between two points.
_SPREAD, _GOLDEN = 0.7, 0.5 * (5.0**0.5 - 1.0)
# Typical values that a frame holds; one far outlier must not flatten all others.
_MOST_RMS = 6.0
_MARGIN, _LEAST_HALF, _LEAST_SPREAD = 1.06, 1e-6, 0.02


def plot_motion_differences(
    table: pd.DataFrame, *, only_in: tuple[int, int] = (0, 0), width: int = PANEL_WIDTH
) -> Figure:
    """Draw B minus A over the larger sigma against the number of orbits, a panel per parameter.

    The points of one number of orbits are spread over a strip about it. The last panel has the
    ratio of the sigmas of the parallax. If the panels would have more than 20,000 points together,
    they have the number of sources in cells instead.

    Parameters
    ----------
    table : `tables.motion_differences`
    only_in : numbers of sources with a motion in A only, and in B only
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, _NONE, width=width, xlabel=_XLABEL, ylabel=_DIFFERENCE)
    half = max(_half(_over(table, name)) for name in PARAMETER_NAMES)
    ratio = f"sigma_ratio_{_RATIO_OF}"
    spread = max(_half(table[ratio].to_numpy(dtype=float) - 1.0), _LEAST_SPREAD)
    panels = [
        _panel(
            table,
            f"over_sigma_{name}",
            title=f"{_upper(words)}: rms {number_text(_rms(_over(table, name)), 2)} σ",
            words=_told(table, name, half),
            y=Axis(_DIFFERENCE, (-half, half)),
            lines=(0.0, (-1.0, 1.0)),
            width=width,
        )
        for name, words in PARAMETER_NAMES.items()
    ]
    median = float(table[ratio].median())
    panels.append(
        _panel(
            table,
            ratio,
            title=f"σ of the {_RATIO_OF}: median {median:.3f}",
            words=_counts(table, only_in),
            y=Axis(_RATIO, (1.0 - spread, 1.0 + spread)),
            lines=(1.0, ()),
            width=width,
        )
    )
    return side_by_side(panels, columns=3, linked="x")


def _panel(
    table: pd.DataFrame,
    column: str,
    *,
    title: str,
    words: str,
    y: Axis,
    lines: tuple[float, tuple[float, ...]],
    width: int,
) -> Figure:
    middle, sigmas = lines
    is_many = (len(PARAMETER_NAMES) + 1) * len(table) > ROW_LIMIT
    marks = _cells(table, column, y.limits) if is_many else _points(table, column)
    guides = [horizontal(middle, name="middle", width=1.0, dash="solid", alpha=0.6)]
    within = [one for one in sigmas if y.limits[0] < one < y.limits[1]]
    if within:
        guides.append(horizontal(within, name="one sigma", width=1.0))
    orbits = table["n_orbits"]
    low, high = float(orbits.min()), float(orbits.max())
    room = 0.5 + 0.02 * (high - low)
    return framed(
        # Lines below points, and above cells, which would hide them.
        [marks, *guides] if is_many else [*guides, marks],
        title=title,
        subtitle=words,
        x=Axis(_XLABEL, (low - room, high + room)),
        y=y,
        width=width,
        height=round(0.62 * width),
        legend_columns=0 if is_many else 3,
    )


def _points(table: pd.DataFrame, column: str) -> Glyphs:
    is_ratio = column.startswith("sigma_ratio")
    values = ("σ of B / σ of A", f"@{{{column}}}{{0.000}}")
    name = column.removeprefix("over_sigma_")
    difference = f"difference_{name}"
    unit = "mas/yr" if name.startswith("pm") else "mas"
    hover = (
        [values]
        if is_ratio
        else [
            ("B minus A", f"@{{{difference}}}{{0.0000}} {unit}"),
            ("over σ", f"@{{{column}}}{{0.000}}"),
        ]
    )
    # Spread about the number of orbits, in an order that is the same in every panel: points of
    # one number would hide each other.
    places = (np.arange(len(table)) * _GOLDEN) % 1.0 - 0.5
    spread = table.assign(place=table["n_orbits"] + _SPREAD * places)
    return class_points(spread, "place", column, hover=[*_HOVER_POINT, *hover])


def _cells(table: pd.DataFrame, column: str, limits: Limits) -> Glyphs:
    """Return the number of sources in cells, whose columns are whole numbers of orbits."""
    orbits = table["n_orbits"].to_numpy(dtype=float)
    low, high = orbits.min() - 0.5, orbits.max() + 0.5
    step = -(-int(high - low) // _MOST_COLUMNS)
    edges = np.arange(low, high + step, step)
    rows = np.linspace(*limits, _ROWS + 1)
    counts, _, _ = np.histogram2d(table[column].to_numpy(dtype=float), orbits, (rows, edges))
    most = max(float(counts.max()), 2.0)
    return image(
        np.where(counts > 0, counts, np.nan),
        (float(edges[0]), float(edges[-1])),
        limits,
        name="counts",
        ramp=Ramp("count", "count", (1.0, most), is_log=True, label=""),
        hover=_HOVER_CELL,
    )


def _told(table: pd.DataFrame, name: str, half: float) -> str:
    typical = angle_text(float(table[f"difference_{name}"].abs().median()))
    unit = f"{typical}/yr" if name.startswith("pm") else typical
    beyond = int((np.abs(_over(table, name)) > half).sum())
    return f"median size {unit}; {f'{beyond:,} beyond' if beyond else 'all within'} the frame"


def _over(table: pd.DataFrame, name: str) -> np.ndarray:
    return table[f"over_sigma_{name}"].to_numpy(dtype=float)


def _counts(table: pd.DataFrame, only_in: tuple[int, int]) -> str:
    return f"{len(table):,} in both runs, {only_in[0]:,} only in A, {only_in[1]:,} only in B"


def _upper(words: str) -> str:
    return words[0].upper() + words[1:]


def _half(values: np.ndarray) -> float:
    """Return half the length of an axis about zero."""
    largest = float(np.nanmax(np.abs(values)))
    return _MARGIN * max(min(largest, _MOST_RMS * _rms(values)), _LEAST_HALF)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))


# Three panels side by side on the page.
_PAGE_WIDTH = 270


def _plot(tables: SurveyTables) -> Figure:
    if tables.other is None:
        text = "There is no run to compare with."
        return message(_TITLE, text, width=_PAGE_WIDTH, xlabel=_XLABEL, ylabel=_DIFFERENCE)
    shared = shared_motions(tables.other.motions, tables.motions)
    only_in = shared.only_a, shared.only_b
    return plot_motion_differences(motion_differences(shared), only_in=only_in, width=_PAGE_WIDTH)


SURVEY_FIGURES = (
    SurveyFigure(
        "motion-differences",
        _TITLE,
        "Fitted motion of a run (B) minus that of another run of the survey (A), source by source, "
        "over the larger of the two sigmas. Both runs fit the same measurements, so that their "
        "errors are nearly the same and this is no unit normal. Good: far below one, so that the "
        "choice between the runs matters less than the uncertainty.",
        SurveyWorkspace.COMPARE,
        66,
        _plot,
        is_wide=True,
        least_height=420,
        equation=(
            "(B − A) / max(σ of A, σ of B), for parallax, proper motion and position at the epoch "
            "of B; σ of B / σ of A"
        ),
        has_data=lambda tables: tables.other is not None,
    ),
)
