"""Goodness of fit: standardised residuals, and chi2 of each exposure."""

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.points import steps, unit_normal
from plateviz.plots.style import (
    FRAME_WIDTH,
    SERIES_COLOURS,
    AxisLabels,
    drawn,
    framed,
    message,
)
from plateviz.plots.theme import theme_of
from plateviz.tables.pulls import exposure_chi2, pull_histogram

_PULLS = "Standardised residuals"
_PULL_LABELS: AxisLabels = {
    "xlabel": "residual over its expected scatter",
    "ylabel": "measurements per bin",
}
_CHI2 = "χ² over its expected value, by exposure"
_CHI2_LABELS: AxisLabels = {"xlabel": "exposure, in order", "ylabel": "χ² / dof"}
_CHI2_HOVER = [
    ("exposure", "@{exposure}"),
    ("measurements", "@{n_obs}"),
    ("χ² / dof", "@{chi2_per_dof}{0.000} ± @{expected_sd}{0.000}"),
    ("departure", "@{z}{0.0} σ"),
]
_BAND_SIGMAS = 2.0


def plot_pulls(
    table: pd.DataFrame, *, theme: str = "light", width: int = FRAME_WIDTH
) -> hv.Overlay:
    """Draw the histogram of standardised residuals in both axes with the unit normal.

    Parameters
    ----------
    table : `tables.pull_histogram`
    theme : "light" or "dark"
    width : of the frame, screen pixels
    """
    if table.empty or not table["n"].any():
        return message(_PULLS, "No residuals", theme=theme, width=width, **_PULL_LABELS)
    one = table[table["axis"] == table["axis"].iloc[0]]
    limit = float(one["right"].max())
    area = float((one["n"] * (one["right"] - one["left"])).iloc[0])
    normal = unit_normal(area, limit, theme)
    top = 1.1 * float(max(table["count"].max(), normal.range("count")[1]))
    return framed(
        [
            *(
                steps(rows, f"residual {axis}", SERIES_COLOURS[number])
                for number, (axis, rows) in enumerate(table.groupby("axis"))
            ),
            normal,
        ],
        title=_PULLS,
        subtitle=_pull_subtitle(table, limit),
        theme=theme,
        width=width,
        height=round(0.62 * width),
        xlim=(-limit, limit),
        ylim=(0.0, top),
        legend_columns=3,
        **_PULL_LABELS,
    )


def plot_exposure_chi2(
    table: pd.DataFrame, *, theme: str = "light", width: int = FRAME_WIDTH
) -> hv.Overlay:
    """Draw chi2 over its expected value for each exposure, with the expected 2 sigma band.

    Parameters
    ----------
    table : `tables.exposure_chi2`
    theme : "light" or "dark"
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_CHI2, "No exposures", theme=theme, width=width, **_CHI2_LABELS)
    colours = theme_of(theme)
    band = _BAND_SIGMAS * table["expected_sd"]
    reach = max(float(band.max()), float((table["chi2_per_dof"] - 1.0).abs().max()))
    # A step per exposure, because the band differs between exposures.
    edges = np.repeat(table["index"].to_numpy(dtype=float), 2) + np.tile([-0.5, 0.5], len(table))
    low, high = np.repeat(1.0 - band.to_numpy(), 2), np.repeat(1.0 + band.to_numpy(), 2)
    area = hv.Area((edges, low, high), "index", ["low", "high"], label="expected ± 2σ")
    points = hv.Points(table, ["index", "chi2_per_dof"], ["exposure", "n_obs", "expected_sd", "z"])
    outside = int((table["z"].abs() > _BAND_SIGMAS).sum())
    return framed(
        [
            drawn(area, color=colours.muted, alpha=0.22, line_alpha=0.0),
            drawn(hv.HLine(1.0), color=colours.line, line_width=1.2, line_dash="dashed"),
            drawn(
                points,
                color=colours.mark,
                size=6,
                tools=["hover"],
                hover_tooltips=_CHI2_HOVER,
            ),
        ],
        title=_CHI2,
        subtitle=f"{outside} of {len(table)} beyond ± 2σ = 2 √(2/dof), "
        f"{0.0455 * len(table):.1f} expected",
        theme=theme,
        width=width,
        height=round(0.4 * width),
        xlim=(-0.5, len(table) - 0.5),
        ylim=(1.0 - 1.25 * reach, 1.0 + 1.25 * reach),
        legend_columns=3,
        **_CHI2_LABELS,
    )


def _pull_subtitle(table: pd.DataFrame, limit: float) -> str:
    parts = [
        f"{axis}: n = {rows['n'].iloc[0]:,}, sd {rows['sd'].iloc[0]:.3f}, "
        f"{rows['outside'].iloc[0]:,} beyond ± {limit:g}"
        for axis, rows in table.groupby("axis")
    ]
    return "\n".join(parts)


def _draw_pulls(chosen: Chosen, theme: str) -> hv.Overlay:
    return plot_pulls(pull_histogram(chosen.result), theme=theme)


def _draw_chi2(chosen: Chosen, theme: str) -> hv.Overlay:
    return plot_exposure_chi2(exposure_chi2(chosen.result), theme=theme)


DIAGNOSTICS = (
    Diagnostic(
        "pulls",
        "Standardised residuals",
        "All residuals over their expected scatter, corrected for leverage. Good: the unit "
        "normal. A wider histogram means underestimated measurement errors, long tails mean "
        "outliers.",
        40,
        _draw_pulls,
    ),
    Diagnostic(
        "exposure-chi2",
        "Chi2 of each exposure",
        "Chi2 of each exposure over its expected value. Good: points inside the band. A single "
        "exposure far above it was disturbed.",
        70,
        _draw_chi2,
    ),
)
