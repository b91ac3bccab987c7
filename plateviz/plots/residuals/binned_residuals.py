"""Mean and scatter of the residuals against time, magnitude, pixel phase and place."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, Glyphs, framed, message, side_by_side
from plateviz.figures.glyphs import horizontal, line, points, strip
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.style import PANEL_WIDTH, SERIES_COLOURS
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.binned_residuals import bin_statistics, binned_residuals

_TITLE = "Residuals against time, magnitude and place"
_YLABEL = "found minus expected (σ)"
_SERIES = (
    ("mean x", "pull_x", "circle"),
    ("mean y", "pull_y", "triangle"),
    ("scatter", "pull_chi2", "square"),
)
_MOST_COLUMNS, _MARGIN = 3, 0.05
# A low frame has no other labels than those at zero and ± 5.
_LEAST_REACH = 5.2
_HOVER = [
    ("@{quantity}", "@{centre}{0.00} @{unit}"),
    ("mean x", "@{mean_x_mpix}{0.00} ± @{sigma_x_mpix}{0.00} mpix"),
    ("mean y", "@{mean_y_mpix}{0.00} ± @{sigma_y_mpix}{0.00} mpix"),
    ("over their σ", "@{pull_x}{0.0}, @{pull_y}{0.0}"),
    ("χ² / dof", "@{chi2_per_dof}{0.000} ± @{sigma_chi2}{0.000}"),
    ("measurements", "@{n}"),
]


def plot_binned_residuals(table: pd.DataFrame, *, width: int = PANEL_WIDTH) -> Figure:
    """Draw what is found in the bins of each quantity over what is expected by chance.

    Parameters
    ----------
    table : `tables.binned_residuals`
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        text = "No bins with enough measurements"
        return message(_TITLE, text, width=FRAME_WIDTH, xlabel="time (min)", ylabel=_YLABEL)
    statistics = bin_statistics(table)
    reach = max(_LEAST_REACH, 1.12 * max(statistics.largest, statistics.limit))
    quantities = [rows for _, rows in table.groupby("quantity", sort=False)]
    panels = [
        _panel(rows, statistics.limit, reach, width, is_first=rows is quantities[0])
        for rows in quantities
    ]
    return side_by_side(panels, columns=min(len(panels), _MOST_COLUMNS))


def _panel(rows: pd.DataFrame, limit: float, reach: float, width: int, *, is_first: bool) -> Figure:
    name, unit = str(rows["quantity"].iloc[0]), str(rows["unit"].iloc[0])
    low, high = float(rows["centre"].min()), float(rows["centre"].max())
    margin = max(_MARGIN * (high - low), 1e-3)
    glyphs: list[Glyphs] = [
        *(strip(-k, k, name=f"{k}σ", alpha=0.12) for k in (2, 1)),
        horizontal(0.0, name="zero", dash="solid", width=1.0),
        horizontal(np.array([-limit, limit]), name="limit"),
    ]
    for (series, pull, marker), colour in zip(_SERIES, SERIES_COLOURS, strict=False):
        glyphs += [
            line(rows["centre"], rows[pull], name=f"line of {series}", color=colour, alpha=0.6),
            points(
                rows,
                "centre",
                pull,
                name=series,
                color=colour,
                marker=marker,
                size=5.0,
                hover=_HOVER,
                label=series,
            ),
        ]
    found = bin_statistics(rows)
    return framed(
        glyphs,
        title=f"Residuals against {name}" if is_first else f"{name[0].upper()}{name[1:]}",
        subtitle=(
            f"largest {found.largest:.1f}σ, {found.of_largest}\n"
            f"{found.beyond} of {found.values} beyond ± 2σ, {found.expected:.1f} expected"
        ),
        x=Axis(f"{name} ({unit})", (low - margin, high + margin)),
        y=Axis(_YLABEL, (-reach, reach)),
        width=width,
        height=round(0.62 * width),
        # One legend is enough for panels that are alike.
        legend_columns=3 if is_first else 0,
    )


# Three panels side by side in a report.
_PAGE_WIDTH = 270


def _plot(chosen: Chosen) -> Figure:
    table = binned_residuals(chosen.result, chosen.instrument)
    return plot_binned_residuals(table, width=_PAGE_WIDTH)


DIAGNOSTICS = (
    Diagnostic(
        "binned-residuals",
        _TITLE,
        "Mean residual along x and y of the detectors, and scatter (χ² / dof minus one), in bins "
        "of time, orbital phase (beyond one period), magnitude (if known), pixel phase and place "
        "on the detector, each over its σ by chance. Good: all within the "
        "dashed lines, which the largest of all passes in one of 100 orbits, and one in twenty "
        "outside ± 2σ. A wave is an effect of that quantity that the fit does not describe; a "
        "scatter that rises is a misstated uncertainty. Each mean is corrected for the share that "
        "the fit absorbs, which is most of it against time: see the shift of each detector.",
        OrbitWorkspace.TRENDS,
        22,
        _plot,
        is_wide=True,
        narrow_height=330,
        column_height=760,
        equation=(
            "mean = Σ w r / (q Σ w), σ² = 1 / (q Σ w), with w = 1/s² and the share q that "
            "the fit leaves; scatter = χ² / dof − 1, σ² = 2 / dof"
        ),
    ),
)
