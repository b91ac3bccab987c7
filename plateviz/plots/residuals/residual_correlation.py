"""Correlation of the residuals of an exposure against separation, in E and B parts."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, Glyphs, framed, message
from plateviz.figures.glyphs import band, horizontal, line, points
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.style import SERIES_COLOURS
from plateviz.plots.elements.ticks import log_ticks
from plateviz.plots.elements.units import angle_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.residual_correlation import correlation_statistics, residual_correlation
from plateviz.tables.rounded import rounded

_TITLE = "Correlation of the residuals, E and B parts"
_XLABEL, _YLABEL = "separation on the focal plane (mm)", "correlation (mpix²)"
_NAMES = {"e": "E, gradient", "b": "B, curl"}
_MARKERS = {"e": "circle", "b": "square"}
# The two parts beside each other, as factors of the separation.
_ASIDE = {"e": 0.98, "b": 1.02}


def plot_residual_correlation(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the E and B parts against separation, with what is expected by chance.

    Parameters
    ----------
    table : `tables.residual_correlation`
    width : of the frame, screen pixels
    """
    if table.empty:
        text = "No pairs of measurements in one exposure"
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel=_YLABEL)
    separation, sigma = table["separation_mm"].to_numpy(), table["sigma"].to_numpy()
    xlim = (0.9 * float(separation[0]), 1.1 * float(separation[-1]))
    reach = 1.15 * max(float(table[["e", "b"]].abs().max().max()), 2.0 * float(sigma.max()))
    # The first and the last one reach to the edges of the frame.
    separation, sigma = np.r_[xlim[0], separation, xlim[1]], np.pad(sigma, 1, mode="edge")
    return framed(
        [
            *(
                band(separation, -k * sigma, k * sigma, name=f"{k}σ", alpha=0.14, label=label)
                for k, label in ((2, "by chance ± 1σ, ± 2σ"), (1, ""))
            ),
            horizontal(0.0, name="zero"),
            *(glyphs for part in _NAMES for glyphs in _part(table, part)),
        ],
        title=_TITLE,
        subtitle=_subtitle(table),
        x=Axis(_XLABEL, xlim, is_log=True, ticks=log_ticks(xlim)),
        y=Axis(_YLABEL, (-reach, reach)),
        width=width,
        height=round(0.62 * width),
        legend_columns=3,
    )


def _part(table: pd.DataFrame, part: str) -> list[Glyphs]:
    number = list(_NAMES).index(part)
    rows = table.assign(x=_ASIDE[part] * table["separation_mm"], part=_NAMES[part])
    colour = SERIES_COLOURS[number]
    hover = [
        ("part", "@{part}"),
        ("separation", "@{separation_mm}{0.0} mm = @{separation_arcmin}{0.0} arcmin"),
        ("correlation", f"@{{{part}}}{{0.0000}} ± @{{sigma}}{{0.0000}} mpix²"),
        ("over its σ", f"@{{pull_{part}}}{{0.0}}"),
    ]
    return [
        line(rows["x"], rows[part], name=f"line {part}", color=colour, width=1.0, alpha=0.5),
        points(
            rows,
            "x",
            part,
            name=part,
            color=colour,
            marker=_MARKERS[part],
            size=6.5,
            line_width=0.0,
            hover=hover,
            label=_NAMES[part],
        ),
    ]


def _subtitle(table: pd.DataFrame) -> str:
    found = correlation_statistics(table)
    return (
        f"Largest E {found.largest_e:.1f}σ, B {found.largest_b:.1f}σ; chance exceeds "
        f"{found.limit:.1f}σ in one of 100 orbits\n"
        f"Smallest σ {rounded(found.least_sigma_mpix2)} mpix² = "
        f"({angle_text(found.least_sigma_mas)})²"
    )


def _plot(chosen: Chosen) -> Figure:
    return plot_residual_correlation(residual_correlation(chosen.result, chosen.instrument))


DIAGNOSTICS = (
    Diagnostic(
        "residual-correlation",
        _TITLE,
        "Correlation of the residuals of two sources in the same exposure against their "
        "separation, as in weak lensing. Good: both parts within the band. E alone means a "
        "gradient field, such as distortion or a telescope that deforms from exposure to "
        "exposure; B means local rotations. Equal parts mean displacements without preferred "
        "direction, such as errors that neighbouring sources share on the detector. Independent "
        "errors, even understated ones, add to neither.",
        OrbitWorkspace.PATTERNS,
        42,
        _plot,
        equation=(
            "ξ± from pairs of residuals w = u + iv: ξ₊ = ⟨Re w₁ w₂*⟩, ξ₋ = ⟨Re w₁ w₂ "
            "exp(−2iφ)⟩; E, B = (ξ₊ ± [ξ₋ − 2 ∫ᵣ^∞ ξ₋ ds/s]) / 2"
        ),
    ),
)
