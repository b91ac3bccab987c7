"""Pointing, roll and focal length of each exposure against time."""

import math

import numpy as np
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
from plateviz.figures.glyphs import horizontal, line, points, strip
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.points import error_bars
from plateviz.plots.elements.units import angle_text, number_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.exposure_tracks import exposure_tracks

_TITLE = "Tracks of the exposures"
_TIME, _NUMBER = "time since the first exposure (min)", "exposure, in order"
_YLABEL = "fitted minus prior centre"
_HOVER = [
    ("exposure", "@{exposure}"),
    ("fitted", "@{value}{0.0000000} @{value_unit}"),
    ("prior centre", "@{prior_centre}{0.0000000} @{value_unit}"),
    ("difference", "@{offset}{0.000} @{unit}"),
    ("σ conditional", "@{sigma_conditional}{0.0000} @{unit}"),
    ("σ marginal", "@{sigma_marginal}{0.0000} @{unit}"),
]
_MARGIN = 0.08


def plot_exposure_tracks(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the parameters of the exposures, fitted minus prior centre, a panel per group.

    Exposures without times are drawn in their order.

    Parameters
    ----------
    table : `tables.exposure_tracks`
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        text = f"{_YLABEL} (mas)"
        return message(_TITLE, "No exposures", width=width, xlabel=_TIME, ylabel=text)
    along = "minutes" if table["minutes"].notna().all() else "number"
    panels = [_panel(rows, along, width) for _, rows in table.groupby("group", sort=False)]
    # Frames with one axis would stay in these columns, whatever the shape of their card.
    return side_by_side(panels, columns=2)


def _panel(rows: pd.DataFrame, along: str, width: int) -> Figure:
    group, unit = str(rows["group"].iloc[0]), str(rows["unit"].iloc[0])
    prior = float(rows["prior_sigma"].median())
    limits = _limits(rows, prior)
    # A strip that fills the frame would say nothing; the words give its width.
    has_edge = prior < max(map(abs, limits))
    return framed(
        [
            *([strip(-prior, prior, name="prior")] if has_edge else []),
            horizontal(0.0, name="zero"),
            _steps(rows, along),
            error_bars(rows, along, "offset", "sigma_conditional", "mark"),
            points(rows, along, "offset", name="exposures", color="mark", size=4.5, hover=_HOVER),
        ],
        title=f"{group[0].upper()}{group[1:]}",
        subtitle=_subtitle(rows, unit, prior),
        x=Axis(_TIME if along == "minutes" else _NUMBER, _spread(rows[along])),
        y=Axis(f"{_YLABEL} ({unit})", limits),
        width=width,
        height=round(0.5 * width),
    )


def _steps(rows: pd.DataFrame, along: str) -> Glyphs:
    """Return a line from each exposure to the next one of its field."""
    parts = [part[[along, "offset"]].to_numpy(float) for _, part in rows.groupby("field_id")]
    # A point that is not a number ends the line.
    gap = np.full((1, 2), np.nan)
    x, y = np.concatenate([piece for part in parts for piece in (part, gap)]).T
    return line(x, y, name="steps", color="muted", width=1.0)


def _spread(values: pd.Series) -> Limits:
    low, high = float(values.min()), float(values.max())
    margin = 0.02 * (high - low) or 0.5
    return low - margin, high + margin


def _limits(rows: pd.DataFrame, prior: float) -> Limits:
    """Return limits that contain all error bars, and the prior's width if it is not much wider."""
    low = float((rows["offset"] - rows["sigma_conditional"]).min())
    high = float((rows["offset"] + rows["sigma_conditional"]).max())
    if prior < high - low:
        low, high = min(low, -prior), max(high, prior)
    margin = _MARGIN * (high - low) or 1.0
    return low - margin, high + margin


def _subtitle(rows: pd.DataFrame, unit: str, prior: float) -> str:
    mean, scatter = float(rows["offset"].mean()), float(rows["offset"].std(ddof=0))
    conditional, marginal = (
        _size(float(rows[f"sigma_{kind}"].median()), unit) for kind in ("conditional", "marginal")
    )
    width = f"± {_size(prior, unit)}" if math.isfinite(prior) else "flat"
    return (
        f"mean {_size(mean, unit)}, scatter {_size(scatter, unit)}; prior {width}\n"
        f"σ conditional {conditional}, marginal {marginal}"
    )


def _size(value: float, unit: str) -> str:
    """Return a number with its unit; small angles are in µas, as in all other words."""
    return angle_text(value) if unit == "mas" else f"{number_text(value, 3)} {unit}"


def _plot(chosen: Chosen) -> Figure:
    return plot_exposure_tracks(exposure_tracks(chosen.result))


DIAGNOSTICS = (
    Diagnostic(
        "exposure-tracks",
        _TITLE,
        "The pointing, the roll and the focal length of each exposure, fitted minus prior centre. "
        "The pointing is an offset on the sky. Good: values well inside the prior (shaded), "
        "without a jump that the telescope did not make. Bars are conditional sigmas: how well "
        "an exposure is known against the others. The marginal sigma is larger where all "
        "exposures can move together against the detectors.",
        OrbitWorkspace.CALIBRATION,
        75,
        _plot,
        is_wide=True,
        least_height=400,
        equation=(
            "fitted − prior centre; the pointing as Δα cos δ and Δδ in the plane "
            "tangent to the sky there"
        ),
    ),
)
