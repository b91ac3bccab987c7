"""Goodness of fit: standardised residuals, and chi2 of each exposure."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, framed, message
from plateviz.figures.glyphs import band, horizontal, points
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.points import steps, unit_normal
from plateviz.plots.elements.style import SERIES_COLOURS
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.pulls import exposure_chi2, pull_histogram

_PULLS = "Standardised residuals"
_PULLS_X, _PULLS_Y = "residual over its expected scatter", "measurements per bin"
_CHI2 = "χ² over its expected value, by exposure"
_CHI2_X, _CHI2_Y = "exposure, in order", "χ² / dof"
_CHI2_HOVER = [
    ("exposure", "@{exposure}"),
    ("measurements", "@{n_obs}"),
    ("χ² / dof", "@{chi2_per_dof}{0.000} ± @{expected_sd}{0.000}"),
    ("departure", "@{z}{0.0} σ"),
]
_BAND_SIGMAS = 2.0


def plot_pulls(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the histogram of standardised residuals in both axes with the unit normal.

    Parameters
    ----------
    table : `tables.pull_histogram`
    width : of the frame, screen pixels
    """
    if table.empty or not table["n"].any():
        return message(_PULLS, "No residuals", width=width, xlabel=_PULLS_X, ylabel=_PULLS_Y)
    one = table[table["axis"] == table["axis"].iloc[0]]
    limit = float(one["right"].max())
    area = float((one["n"] * (one["right"] - one["left"])).iloc[0])
    normal = unit_normal(area, limit)
    top = 1.1 * float(max(table["count"].max(), normal.values("y").max()))
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
        x=Axis(_PULLS_X, (-limit, limit)),
        y=Axis(_PULLS_Y, (0.0, top)),
        width=width,
        height=round(0.62 * width),
        legend_columns=3,
    )


def plot_exposure_chi2(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw chi2 over its expected value for each exposure, with the expected 2 sigma band.

    Parameters
    ----------
    table : `tables.exposure_chi2`
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_CHI2, "No exposures", width=width, xlabel=_CHI2_X, ylabel=_CHI2_Y)
    expected = _BAND_SIGMAS * table["expected_sd"].to_numpy(dtype=float)
    reach = 1.25 * max(float(expected.max()), float((table["chi2_per_dof"] - 1.0).abs().max()))
    # A step per exposure, because the band differs between exposures.
    edges = np.repeat(table["index"].to_numpy(dtype=float), 2) + np.tile([-0.5, 0.5], len(table))
    low, high = np.repeat(1.0 - expected, 2), np.repeat(1.0 + expected, 2)
    outside = int((table["z"].abs() > _BAND_SIGMAS).sum())
    return framed(
        [
            band(edges, low, high, name="band", label="expected ± 2σ"),
            horizontal(1.0, name="expected"),
            points(
                table,
                "index",
                "chi2_per_dof",
                name="exposures",
                color="mark",
                size=6.0,
                hover=_CHI2_HOVER,
            ),
        ],
        title=_CHI2,
        subtitle=f"{outside} of {len(table)} beyond ± 2σ = 2 √(2/dof), "
        f"{0.0455 * len(table):.1f} expected",
        x=Axis(_CHI2_X, (-0.5, len(table) - 0.5)),
        # Symmetric about 1, but chi2 is not negative.
        y=Axis(_CHI2_Y, (max(0.0, 1.0 - reach), 1.0 + reach)),
        width=width,
        height=round(0.4 * width),
        legend_columns=3,
    )


def _pull_subtitle(table: pd.DataFrame, limit: float) -> str:
    parts = [
        f"{axis}: n = {rows['n'].iloc[0]:,}, sd {rows['sd'].iloc[0]:.3f}, "
        f"{rows['outside'].iloc[0]:,} beyond ± {limit:g}"
        for axis, rows in table.groupby("axis")
    ]
    return "\n".join(parts)


def _plot_pulls(chosen: Chosen) -> Figure:
    return plot_pulls(pull_histogram(chosen.result))


def _plot_chi2(chosen: Chosen) -> Figure:
    return plot_exposure_chi2(exposure_chi2(chosen.result))


DIAGNOSTICS = (
    Diagnostic(
        "pulls",
        "Standardised residuals",
        "All residuals over their expected scatter, corrected for leverage. Good: the unit "
        "normal. A wider histogram means underestimated measurement errors, long tails mean "
        "outliers.",
        OrbitWorkspace.RESIDUALS,
        40,
        _plot_pulls,
        is_key=True,
        equation=(
            "z = r / (s √(1 − h/2)), with the residual r, the error s of a measurement "
            "and its leverage h"
        ),
    ),
    Diagnostic(
        "exposure-chi2",
        "Chi2 of each exposure",
        "Chi2 of each exposure over its expected value. Good: points inside the band. A single "
        "exposure far above it was disturbed.",
        OrbitWorkspace.TRENDS,
        70,
        _plot_chi2,
        is_key=True,
        equation=(
            "χ² / dof, dof = 2 N − Σ h, with the leverages h of the N measurements; "
            "band 1 ± 2 √(2 / dof)"
        ),
    ),
)
