"""Deviation from the truth on the sky, by class (paper, figure "residual:onsky")."""

import math

import holoviews as hv
import numpy as np
import pandas as pd

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.points import class_points
from plateviz.plots.style import PANEL_WIDTH, drawn, framed, message, side_by_side
from plateviz.plots.theme import theme_of
from plateviz.plots.units import angle_unit
from plateviz.tables.sources import CLASSES, deviation, deviation_statistics

_TITLE = "Deviation from the truth"
_HOVER = [
    ("source", "@{id}"),
    ("measurements", "@{n_obs}"),
    ("Δα cos δ", "@{deviation_ra_mas}{0.0000} ± @{sigma_ra_mas}{0.0000} mas"),
    ("Δδ", "@{deviation_dec_mas}{0.0000} ± @{sigma_dec_mas}{0.0000} mas"),
]
_EXTRA = [
    "n_obs",
    "deviation_ra_mas",
    "deviation_dec_mas",
    "sigma_ra_mas",
    "sigma_dec_mas",
]
_LEAST_SIGMAS = 3.0
_MOST_RMS = 6.0


def plot_deviation(
    table: pd.DataFrame, *, theme: str = "light", width: int = PANEL_WIDTH
) -> hv.Layout | hv.Overlay:
    """Draw estimated minus true position, a panel per class of source.

    Parameters
    ----------
    table : `tables.deviation`
    theme : "light" or "dark"
    width : of each panel's frame, screen pixels

    Returns
    -------
    A layout of the classes in the table; without a truth, a figure with a message
    """
    if table.empty:
        return message(
            _TITLE,
            "No truth for this orbit",
            theme=theme,
            width=width,
            xlabel="Δα cos δ (mas)",
            ylabel="Δδ (mas)",
        )
    statistics = deviation_statistics(table).set_index("source_class")
    panels = [
        _panel(table[table["source_class"] == name], statistics.loc[name], theme, width)
        for name in reversed(CLASSES)
        if name in statistics.index
    ]
    return side_by_side(panels, columns=3)


def _panel(rows: pd.DataFrame, statistics: pd.Series, theme: str, width: int) -> hv.Overlay:
    unit, factor = angle_unit(max(statistics["rms_ra"], statistics["rms_dec"]))
    x = hv.Dimension("x", label=f"Δα cos δ ({unit}, East to the left)")
    y = hv.Dimension("y", label=f"Δδ ({unit})")
    scaled = rows.assign(x=rows["deviation_ra_mas"] * factor, y=rows["deviation_dec_mas"] * factor)
    half = factor * _half_width(rows, statistics)
    hidden = int((np.abs(scaled[["x", "y"]]).max(axis=1) > half).sum())
    line = theme_of(theme).line
    zero = [hv.HLine(0), hv.VLine(0)]
    return framed(
        [
            *(drawn(z, color=line, line_width=1, alpha=0.6) for z in zero),
            class_points(scaled, x, y, hover=_HOVER, extra=_EXTRA),
            drawn(_ellipse(statistics, factor), color=line, line_width=1.8),
        ],
        title=f"{rows['source_class'].iloc[0].capitalize()} sources",
        subtitle=_subtitle(statistics, unit, factor, hidden),
        theme=theme,
        width=width,
        xlim=(half, -half),
        ylim=(-half, half),
        xlabel=x.label,
        ylabel=y.label,
    )


def _half_width(rows: pd.DataFrame, statistics: pd.Series) -> float:
    """Return half the frame in mas; it contains every point unless a few lie very far out."""
    largest = float(np.abs(rows[["deviation_ra_mas", "deviation_dec_mas"]].to_numpy()).max())
    typical = max(statistics["rms_ra"], statistics["rms_dec"])
    least = _LEAST_SIGMAS * float(np.sqrt(max(statistics["var_ra"], statistics["var_dec"])))
    return 1.05 * (max(least, min(largest, _MOST_RMS * typical)) or 1.0)


def _ellipse(statistics: pd.Series, factor: float) -> hv.Ellipse:
    covariance = np.array(
        [
            (statistics["var_ra"], statistics["cov"]),
            (statistics["cov"], statistics["var_dec"]),
        ]
    )
    values, vectors = np.linalg.eigh(covariance)
    axes = 2.0 * factor * np.sqrt(np.clip(values[::-1], 0.0, None))
    major = vectors[:, 1]
    return hv.Ellipse(0, 0, tuple(axes), orientation=float(np.arctan2(major[1], major[0])))


def _subtitle(statistics: pd.Series, unit: str, factor: float, hidden: int) -> str:
    """Return three lines that fit a narrow panel, because panels of unequal height are clipped."""
    rms = factor * max(statistics["rms_ra"], statistics["rms_dec"])
    decimals = min(3, max(0, 2 - math.floor(math.log10(rms)))) if rms > 0 else 0
    mean, spread = (
        ", ".join(f"{factor * statistics[f'{name}_{c}']:.{decimals}f}" for c in ("ra", "dec"))
        for name in ("mean", "rms")
    )
    pulls = f"{statistics['pull_rms_ra']:.2f}, {statistics['pull_rms_dec']:.2f}"
    return (
        f"mean {mean}; rms {spread} {unit} (α, δ)\n"
        f"n = {statistics['n']:,.0f}; rms of deviation / σ: {pulls}\n"
        f"ellipse: mean marginal 1σ; {f'{hidden:,} beyond' if hidden else 'all within'} the frame"
    )


# Three classes side by side on the page.
_PAGE_WIDTH = 270


def _draw(chosen: Chosen, theme: str) -> hv.Layout | hv.Overlay:
    return plot_deviation(
        deviation(chosen.result, chosen.result.true_places), theme=theme, width=_PAGE_WIDTH
    )


DIAGNOSTICS = (
    Diagnostic(
        "deviation",
        "Deviation from the truth",
        "Estimated minus true position on the sky, for each class of source; only for simulated "
        "orbits. Good: an rms of deviation / σ of one. A common shift is the mean error of the "
        "reference sources.",
        50,
        _draw,
        is_wide=True,
        has_data=lambda chosen: chosen.result.true_places is not None,
    ),
)
