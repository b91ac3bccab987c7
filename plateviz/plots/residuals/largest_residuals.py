"""Largest residuals of measurements and of sources, against the sizes expected by chance."""

import pandas as pd

from plateviz.figures.figure import (
    FRAME_WIDTH,
    Axis,
    Figure,
    Glyphs,
    Limits,
    framed,
    message,
    side_by_side,
)
from plateviz.figures.glyphs import band, horizontal, line, points, texts
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.style import SERIES_COLOURS
from plateviz.plots.elements.ticks import log_ticks
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.largest_residuals import MEASUREMENT, SOURCE, largest_residuals

_TITLE = "Largest residuals"
_XLABEL = "χ expected at this rank (σ)"
_YLABELS = {MEASUREMENT: "χ of a measurement (σ)", SOURCE: "χ of a source (σ)"}
_TITLES = {MEASUREMENT: "Measurements in order of χ", SOURCE: "Sources in order of χ"}
_COMMON = [("source", "@{id}"), ("rank", "@{rank}"), ("χ", "@{chi}{0.00} σ")]
_EXPECTED = ("expected at this rank", "@{expected}{0.00} σ")
_HOVERS = {
    MEASUREMENT: [
        *_COMMON,
        _EXPECTED,
        ("exposure", "@{exposure}"),
        ("detector", "@{detector}"),
    ],
    SOURCE: [
        *_COMMON,
        _EXPECTED,
        ("χ² / dof", "@{chi2_per_dof}{0.000}"),
        ("measurements", "@{n_obs}"),
    ],
}
# From a larger multiple of the level on, values are drawn on logarithmic axes.
_LINEAR_UP_TO = 3.0
_LEAST_ON_LOG = 0.3


def plot_largest_residuals(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the residuals in order of size against the size expected, a panel per kind.

    Parameters
    ----------
    table : `tables.largest_residuals`
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        ylabel = _YLABELS[MEASUREMENT]
        return message(_TITLE, "No residuals", width=width, xlabel=_XLABEL, ylabel=ylabel)
    kinds = table.groupby("kind", sort=False)
    return side_by_side([_panel(str(kind), rows, width) for kind, rows in kinds], columns=2)


def _panel(kind: str, rows: pd.DataFrame, width: int) -> Figure:
    level, largest = float(rows["level"].iloc[0]), float(rows["chi"].max())
    is_log = largest > _LINEAR_UP_TO * level
    low = _LEAST_ON_LOG if is_log else 0.0
    x = (low, 1.08 * max(float(rows["expected"].max()), 2.0 * low))
    y = (low, (1.3 if is_log else 1.1) * max(largest, level))
    return framed(
        [
            band(rows["expected"], rows["low"], rows["high"], name="band", label="95 % of orbits"),
            line(x, x, name="expected", color="line", width=1.2, label="as expected"),
            horizontal(level, name="level"),
            texts(
                [x[0]],
                [level],
                [" 1 % by chance"],
                name="level text",
                align="left",
                baseline="bottom",
            ),
            *_points(kind, rows),
        ],
        title=_TITLES[kind],
        subtitle=_subtitle(kind, rows, level),
        x=_axis(_XLABEL, x, is_log),
        y=_axis(_YLABELS[kind], y, is_log),
        width=width,
        height=round(0.62 * width),
        legend_columns=3,
    )


def _points(kind: str, rows: pd.DataFrame) -> list[Glyphs]:
    # The strong ones are drawn again above, so that they cover the others.
    beyond = rows[rows["is_beyond"]]
    ordinary = points(
        rows,
        "expected",
        "chi",
        name="residuals",
        color="mark",
        size=4.0,
        alpha=0.8,
        line_width=0.0,
        hover=_HOVERS[kind],
        keep=["id"],
    )
    strong = points(
        beyond,
        "expected",
        "chi",
        name="beyond",
        color=SERIES_COLOURS[1],
        size=8.0,
        line_width=0.0,
        hover=_HOVERS[kind],
        label="beyond chance",
        keep=["id"],
    )
    return [ordinary, strong]


def _axis(label: str, limits: Limits, is_log: bool) -> Axis:
    return Axis(label, limits, is_log=is_log, ticks=log_ticks(limits) if is_log else None)


def _subtitle(kind: str, rows: pd.DataFrame, level: float) -> str:
    count = int(rows["count"].iloc[0])
    found = int(rows["is_beyond"].sum())
    beyond = f"at least {found:,}" if found == len(rows) < count else f"{found:,}"
    return (
        f"{beyond} of {count:,} {kind}s beyond {level:.2f} σ, "
        "which the largest exceeds by chance in 1 %"
    )


def _plot(chosen: Chosen) -> Figure:
    return plot_largest_residuals(largest_residuals(chosen.result))


DIAGNOSTICS = (
    Diagnostic(
        "largest-residuals",
        _TITLE,
        "The standardised residuals of all measurements in order of size, both coordinates "
        "together, against the size that is expected at this rank; and the same for the chi2 of "
        "whole sources, converted to two degrees of freedom. Good: on the line and inside the "
        "band up to the last point. A measurement above the dashed line is an outlier. A source "
        "above it has such measurements, or is not at rest during the orbit.",
        OrbitWorkspace.RESIDUALS,
        44,
        _plot,
        is_wide=True,
        equation=(
            "χ² = z(x)² + z(y)², with standardised residuals z; expected at rank k of "
            "n: the median of the k-th largest of n draws of χ² with two degrees of "
            "freedom"
        ),
    ),
)
