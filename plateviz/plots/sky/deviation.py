"""Deviation from the truth on the sky, by class (paper, figure "residual:onsky")."""

import math

import numpy as np
import pandas as pd

from plateviz.figures.figure import Axis, Figure, framed, message, side_by_side
from plateviz.figures.glyphs import ellipse, horizontal, vertical
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.points import class_points
from plateviz.plots.elements.style import PANEL_WIDTH
from plateviz.plots.elements.units import angle_unit
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.rounded import with_minus_signs
from plateviz.tables.sources import CLASSES, deviation, deviation_statistics
from plateviz.tables.summary import LEAST_OBS

_TITLE = "Deviation from the truth"
_HOVER = [
    ("source", "@{id}"),
    ("measurements", "@{n_obs}"),
    ("Δα cos δ", "@{deviation_ra_mas}{0.0000} ± @{sigma_ra_mas}{0.0000} mas"),
    ("Δδ", "@{deviation_dec_mas}{0.0000} ± @{sigma_dec_mas}{0.0000} mas"),
]
_LEAST_SIGMAS = 3.0
_MOST_RMS = 6.0


def plot_deviation(table: pd.DataFrame, *, width: int = PANEL_WIDTH) -> Figure:
    """Draw estimated minus true position, a panel per class of source.

    Parameters
    ----------
    table : `tables.deviation`
    width : of each panel's frame, screen pixels

    Returns
    -------
    A frame per class in the table; without a truth, a figure with a message
    """
    if table.empty:
        return message(
            _TITLE,
            "No truth for this orbit",
            width=width,
            xlabel="Δα cos δ (mas)",
            ylabel="Δδ (mas)",
        )
    statistics = deviation_statistics(table).set_index("source_class")
    panels = [
        _panel(table[table["source_class"] == name], statistics.loc[name], width)
        for name in reversed(CLASSES)
        if name in statistics.index
    ]
    return side_by_side(panels, columns=3)


def _panel(rows: pd.DataFrame, statistics: pd.Series, width: int) -> Figure:
    unit, factor = angle_unit(max(statistics["rms_ra"], statistics["rms_dec"]))
    scaled = rows.assign(x=rows["deviation_ra_mas"] * factor, y=rows["deviation_dec_mas"] * factor)
    half = factor * _half_width(rows, statistics)
    hidden = int((np.abs(scaled[["x", "y"]]).max(axis=1) > half).sum())
    return framed(
        [
            horizontal(0.0, width=1.0, dash="solid", alpha=0.6),
            vertical(0.0, width=1.0, dash="solid", alpha=0.6),
            class_points(scaled, "x", "y", hover=_HOVER),
            ellipse(_covariance(statistics), scale=factor, name="mean covariance"),
        ],
        title=f"All {rows['source_class'].iloc[0]} sources",
        subtitle=_subtitle(statistics, unit, factor, hidden),
        x=Axis(f"Δα cos δ ({unit}, East to the left)", (half, -half)),
        y=Axis(f"Δδ ({unit})", (-half, half)),
        width=width,
    )


def _half_width(rows: pd.DataFrame, statistics: pd.Series) -> float:
    """Return half the frame in mas; it contains every point unless a few lie very far out."""
    largest = float(np.abs(rows[["deviation_ra_mas", "deviation_dec_mas"]].to_numpy()).max())
    typical = max(statistics["rms_ra"], statistics["rms_dec"])
    least = _LEAST_SIGMAS * float(np.sqrt(max(statistics["var_ra"], statistics["var_dec"])))
    return 1.05 * (max(least, min(largest, _MOST_RMS * typical)) or 1.0)


def _covariance(statistics: pd.Series) -> np.ndarray:
    return np.array(
        [
            (statistics["var_ra"], statistics["cov"]),
            (statistics["cov"], statistics["var_dec"]),
        ]
    )


def _subtitle(statistics: pd.Series, unit: str, factor: float, hidden: int) -> str:
    """Return short lines: in a narrow frame, longer ones would take the room of the picture."""
    rms = factor * max(statistics["rms_ra"], statistics["rms_dec"])
    decimals = min(3, max(0, 2 - math.floor(math.log10(rms)))) if rms > 0 else 0
    mean, spread = (
        ", ".join(f"{factor * statistics[f'{name}_{c}']:.{decimals}f}" for c in ("ra", "dec"))
        for name in ("mean", "rms")
    )
    pulls = f"{statistics['pull_rms_ra']:.2f}, {statistics['pull_rms_dec']:.2f}"
    return (
        f"rms of Δ/σ: {pulls} (α, δ)\n"
        f"mean {with_minus_signs(mean)} {unit}\n"
        f"rms {spread} {unit}; n = {statistics['n']:,.0f}\n"
        f"ellipse: 1σ; {f'{hidden:,} beyond' if hidden else 'all in'} the frame"
    )


# Three classes side by side on the page.
_PAGE_WIDTH = 270


def _plot(chosen: Chosen) -> Figure:
    table = deviation(chosen.result, chosen.result.true_places)
    return plot_deviation(table, width=_PAGE_WIDTH)


DIAGNOSTICS = (
    Diagnostic(
        "deviation",
        "Deviation from the truth",
        "Estimated minus true position on the sky of all sources of each class; only for simulated "
        f"orbits. The numbers above the figures are of sources with {LEAST_OBS} or more "
        "measurements. Good: an rms of Δ/σ of one, so that the points fill the ellipse, the mean "
        "marginal σ. A common shift is the mean error of the reference sources.",
        OrbitWorkspace.SKY,
        50,
        _plot,
        is_wide=True,
        narrow_height=380,
        has_data=lambda chosen: chosen.result.true_places is not None,
        equation="Δ = estimate − truth; rms of Δ / σ, with the marginal σ",
    ),
)
