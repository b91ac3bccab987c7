"""Shift of each detector in the course of an orbit."""

from dataclasses import replace

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
from plateviz.plots.elements.style import SERIES_COLOURS
from plateviz.plots.elements.units import angle_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.detector_shifts import detector_shifts, shift_statistics
from plateviz.tables.rounded import rounded

_TITLE = "Shift of each detector within the orbit"
_XLABEL = "time since the first exposure (min)"
_MARGIN = 0.03


def plot_detector_shifts(table: pd.DataFrame, *, width: int = FRAME_WIDTH) -> Figure:
    """Draw the shift of each detector over time along x and y, with what is expected by chance.

    Parameters
    ----------
    table : `tables.detector_shifts`; the rows of the smallest groups are drawn as points, those
        of the largest as lines with error bars
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        text = "No detector whose shift the pointings leave in the residuals"
        return message(_TITLE, text, width=width, xlabel=_XLABEL, ylabel="shift (mpix)")
    minutes = table["minutes"]
    margin = max(_MARGIN * float(minutes.max()), 0.1)
    xlim = (float(minutes.min()) - margin, float(minutes.max()) + margin)
    reach = 1.1 * float(table[["shift_x_mpix", "shift_y_mpix"]].abs().max().max())
    panels = [_panel(table, axis, xlim, reach, width) for axis in "xy"]
    return side_by_side(panels, columns=2, linked="xy")


def _panel(table: pd.DataFrame, axis: str, xlim: Limits, reach: float, width: int) -> Figure:
    single = table[table["together"] == table["together"].min()]
    means = table[table["together"] == table["together"].max()]
    sigma = shift_statistics(single).sigma_mpix
    glyphs = [
        *(strip(-k * sigma, k * sigma, name=f"{k}σ", alpha=0.12) for k in (2, 1)),
        horizontal(0.0, name="zero"),
    ]
    for number, detector_id in enumerate(sorted(table["detector_id"].unique())):
        colour = SERIES_COLOURS[number % len(SERIES_COLOURS)]
        rows, of_means = (one[one["detector_id"] == detector_id] for one in (single, means))
        glyphs += _detector(rows, of_means, axis, f"detector {detector_id}", colour)
    return framed(
        glyphs,
        title=f"Shift of each detector in {axis}",
        subtitle=_subtitle(single, means, axis),
        x=Axis(_XLABEL, xlim),
        y=Axis(f"shift in {axis} (mpix)", (-reach, reach)),
        width=width,
        height=round(0.7 * width),
        legend_columns=4,
    )


def _detector(
    rows: pd.DataFrame, means: pd.DataFrame, axis: str, name: str, colour: str
) -> list[Glyphs]:
    shift, sigma = f"shift_{axis}_mpix", f"sigma_{axis}_mpix"
    hover = [
        ("detector", "@{detector_id}"),
        ("exposure", "@{exposure}"),
        ("shift", f"@{{{shift}}}{{0.00}} ± @{{{sigma}}}{{0.00}} mpix"),
        ("on the sky", f"@{{shift_{axis}_mas}}{{0.00}} ± @{{sigma_{axis}_mas}}{{0.00}} mas"),
        ("over its σ", f"@{{pull_{axis}}}{{0.0}}"),
        ("measurements", "@{n}"),
    ]
    bars = error_bars(means, "minutes", shift, sigma, colour)
    return [
        points(
            rows,
            "minutes",
            shift,
            name=name,
            color=colour,
            size=3.5,
            alpha=0.35,
            line_width=0.0,
            hover=hover,
        ),
        replace(bars, name=f"{bars.name}, {name}"),
        line(means["minutes"], means[shift], name=f"mean of {name}", color=colour, label=name),
    ]


def _subtitle(single: pd.DataFrame, means: pd.DataFrame, axis: str) -> str:
    found, of_means = shift_statistics(single), shift_statistics(means)
    if axis == "x":
        return (
            "Points: one exposure, with ± 1σ and ± 2σ in grey, σ = "
            f"{rounded(found.sigma_mpix)} mpix = "
            f"{angle_text(found.sigma_mas)} by chance; lines: means of {means['together'].iloc[0]}"
        )
    return (
        f"x and y: {found.beyond} of {found.values:,} beyond ± 2σ, {found.expected:.1f} expected; "
        f"largest {found.largest:.1f}σ, of the means {of_means.largest:.1f}σ; chance exceeds "
        f"{found.limit:.1f}σ and {of_means.limit:.1f}σ in one of 100 orbits"
    )


def _plot(chosen: Chosen) -> Figure:
    return plot_detector_shifts(detector_shifts(chosen.result, chosen.instrument))


DIAGNOSTICS = (
    Diagnostic(
        "detector-shifts",
        _TITLE,
        "Mean residual of each detector over time, corrected for the shares that pointing, roll "
        "and focal length of the exposure and the source positions absorb. Good: points and "
        "lines about zero, one point in twenty outside the wider band. A slope or a step means "
        "that a detector moved, for which the fit has one place in the whole orbit; steps of all "
        "detectors from field to field mean distortion that the order does not describe.",
        OrbitWorkspace.TRENDS,
        75,
        _plot,
        is_wide=True,
        equation=(
            "shift = mean residual / share that is left by pointing, roll, focal length "
            "and source positions"
        ),
    ),
)
