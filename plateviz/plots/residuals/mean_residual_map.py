"""Mean residual over the focal plane as two images, one for each axis."""

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
from plateviz.figures.glyphs import rectangles
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.focal_plane import XLABEL, YLABEL, detector_outlines
from plateviz.plots.elements.style import PANEL_WIDTH
from plateviz.plots.elements.units import angle_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.mean_residuals import (
    MapStatistics,
    detector_statistics,
    map_statistics,
    mean_residuals,
)
from plateviz.tables.rounded import rounded, with_error
from solver.data.instrument import Instrument
from solver.data.plural import plural
from solver.units import UM_PER_MM

_TITLE = "Mean residual over the focal plane"
_MARGIN = 1.06
# The colours end at this number of sigmas of a typical bin, of which chance leaves few beyond.
_COLOUR_SIGMAS = 4.0
_OF_DETECTOR = ["spread", "spread_scatter", "largest", "limit"]


def plot_mean_residual_map(
    table: pd.DataFrame, instrument: Instrument, *, width: int = PANEL_WIDTH
) -> Figure:
    """Draw the mean residual of each bin along x and y, coloured from blue through zero to orange.

    Parameters
    ----------
    table : `tables.mean_residuals`
    instrument : whose detectors are outlined
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        text = "No bins in which the fit leaves enough of the residuals"
        return message(_TITLE, text, width=width, xlabel=XLABEL, ylabel=YLABEL)
    corners = [d.corners_um() / UM_PER_MM for d in instrument.detectors]
    low, high = np.min(corners, axis=(0, 1)), np.max(corners, axis=(0, 1))
    middle, half = 0.5 * (low + high), 0.5 * _MARGIN * float((high - low).max())
    limits = [(float(at - half), float(at + half)) for at in middle]
    statistics, detectors = map_statistics(table), detector_statistics(table)
    of_detectors = detectors.set_index("detector_id")[_OF_DETECTOR].add_prefix("detector_")
    table = table.join(of_detectors, on="detector_id")
    outlines = detector_outlines(instrument.detectors)
    subtitles = {"x": _bins_in_words(statistics), "y": _chance_in_words(statistics, detectors)}
    panels = [
        _panel(table, axis, statistics, outlines, limits, subtitle, width)
        for axis, subtitle in subtitles.items()
    ]
    return side_by_side(panels, columns=2, linked="xy")


def _panel(
    table: pd.DataFrame,
    axis: str,
    statistics: MapStatistics,
    outlines: Glyphs,
    limits: list[Limits],
    subtitle: str,
    width: int,
) -> Figure:
    reach = _COLOUR_SIGMAS * statistics.sigma_mpix
    ramp = Ramp(f"mean_{axis}_mpix", "difference", (-reach, reach), label="mpix")
    bins = rectangles(
        table,
        name="bins",
        color=ramp,
        hover=[
            (
                "mean residual",
                f"@{{mean_{axis}_mpix}}{{0.000}} ± @{{sigma_{axis}_mpix}}{{0.000}} mpix",
            ),
            ("on the sky", f"@{{mean_{axis}_mas}}{{0.000}} ± @{{sigma_{axis}_mas}}{{0.000}} mas"),
            ("over its σ", f"@{{pull_{axis}}}{{0.0}}"),
            ("measurements", "@{n}"),
            ("detector", "@{detector_id}"),
            (
                "its scatter over chance",
                "@{detector_spread}{0.00} ± @{detector_spread_scatter}{0.00}",
            ),
            ("its largest bin", "@{detector_largest}{0.0} σ (≤ @{detector_limit}{0.0} σ)"),
        ],
    )
    return framed(
        [bins, outlines],
        title=f"Mean residual in {axis}",
        subtitle=subtitle,
        x=Axis(XLABEL, limits[0]),
        y=Axis(YLABEL, limits[1]),
        width=width,
    )


def _bins_in_words(statistics: MapStatistics) -> str:
    spread = with_error(statistics.spread, statistics.spread_scatter, 1)
    return (
        f"{statistics.n:,} {plural(statistics.n, 'measurement')} in "
        f"{statistics.bins:,} {plural(statistics.bins, 'bin')}, ± "
        f"{rounded(statistics.sigma_mpix)} mpix = {angle_text(statistics.sigma_mas)} by chance\n"
        f"scatter {spread} times chance; colours to ± {_COLOUR_SIGMAS:g}σ"
    )


def _chance_in_words(statistics: MapStatistics, detectors: pd.DataFrame) -> str:
    whole = f"x and y: largest {_largest(statistics.largest, statistics.limit)}"
    if len(detectors) < 2:
        return whole
    row = detectors.loc[(detectors["largest"] / detectors["limit"]).idxmax()]
    beyond = int(detectors["is_beyond"].sum())
    return (
        f"{whole}\n{beyond} of {len(detectors)} detectors beyond their limit; "
        f"furthest {row['detector_id']}: {_largest(row['largest'], row['limit'])}"
    )


def _largest(value: float, limit: float) -> str:
    """Return the largest bin, and what chance exceeds in one of a hundred maps."""
    return f"{value:.1f}σ (≤ {limit:.1f}σ)"


def _plot(chosen: Chosen) -> Figure:
    table = mean_residuals(chosen.result, chosen.instrument)
    return plot_mean_residual_map(table, chosen.instrument)


DIAGNOSTICS = (
    Diagnostic(
        "mean-residual-map",
        _TITLE,
        "Measured minus predicted position in all exposures, its mean in square bins over the "
        "detectors, corrected for what the source positions absorb. Good: "
        "no pattern, a scatter as expected by chance, and a largest bin below the stated limit, on "
        "the whole and on each detector. "
        "Neighbouring bins of one colour mean distortion that the order does not describe; a "
        "single bin or column means a defect of the detector.",
        OrbitWorkspace.PATTERNS,
        25,
        _plot,
        is_wide=True,
        equation=(
            "mean = Σ w r / Σ w (1 − h), with w = 1/s², the error s of a measurement, "
            "and the share h that the source positions absorb; σ² = 1 / Σ w (1 − h)"
        ),
    ),
)
