"""Difference between the fitted distortion and the true one as vectors on the focal plane."""

from collections.abc import Sequence
from dataclasses import replace

import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Figure, message
from plateviz.plots.comparison.distortion_comparison import plot_distortion_comparison
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.focal_plane import XLABEL, YLABEL
from plateviz.plots.elements.units import angle_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.distortion_comparison import ALONE, TOGETHER, distortion_truth
from solver.data.instrument import Detector
from solver.simulate.true_calibration import TrueCalibration, true_calibration

_NONE = "No truth: this orbit was not simulated here."
_TITLES = {
    ALONE: "Distortion, fit minus truth",
    TOGETHER: "Distortion and detectors, fit minus truth",
}


def plot_distortion_truth(
    table: pd.DataFrame,
    *,
    truth: TrueCalibration | None = None,
    detectors: Sequence[Detector] = (),
    width: int = FRAME_WIDTH,
) -> Figure:
    """Draw the difference of the distortion alone, and of distortion and detectors, to scale.

    Parameters
    ----------
    table : `tables.distortion_truth`
    truth : of the orbit; the figure says what it is the mean of
    detectors : detectors to outline
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        return message(_TITLES[ALONE], _NONE, width=width, xlabel=XLABEL, ylabel=YLABEL)
    figure = plot_distortion_comparison(table, detectors=detectors, titles=_TITLES, width=width)
    sigma = angle_text(float(table["source_mas"].iloc[0]))
    lines = [f"σ of a source: {sigma}", *([] if truth is None else _which_truth(truth))]
    words = "".join(f"\n{line}" for line in lines)
    frames = [replace(one, subtitle=one.subtitle + words) for one in figure.frames]
    return replace(figure, frames=tuple(frames))


def _which_truth(truth: TrueCalibration) -> list[str]:
    """Return what the truth is where the simulated calibration was not one for all exposures."""
    lines = []
    if truth.averaged:
        lines.append(f"Truth: mean over the exposures of: {', '.join(truth.averaged)}")
    if truth.left_out:
        lines.append(f"Not in the truth: {', '.join(truth.left_out)}")
    return lines


def _plot(chosen: Chosen) -> Figure:
    truth = _truth(chosen)
    if truth is None:
        return message(_TITLES[ALONE], _NONE)
    table = distortion_truth(chosen.result, truth, chosen.instrument)
    return plot_distortion_truth(table, truth=truth, detectors=chosen.instrument.detectors)


def _truth(chosen: Chosen) -> TrueCalibration | None:
    if chosen.simulation is None:
        return None
    return true_calibration(chosen.simulation, chosen.instrument, chosen.result.exposures)


DIAGNOSTICS = (
    Diagnostic(
        "distortion-truth",
        "Distortion minus truth",
        "The fitted distortion minus that of the simulation, left, and the same with the places, "
        "rotations, pitches and own distortions of the detectors, right. A common shift, roll and "
        "scale are removed, because pointing, roll and focal length absorb them; the focal length "
        "itself is not compared. Good: on the right, arrows below the σ of a source (median, "
        "marginal), of which they are a part; a smooth pattern of that size is a weak direction. "
        "What is on the left alone has gone to the detectors and moves no star. Where the "
        "calibration changes during the orbit, fit and truth are means over the exposures; the "
        "truth has the terms above the fitted order.",
        OrbitWorkspace.CALIBRATION,
        80,
        _plot,
        is_wide=True,
        has_data=lambda chosen: _truth(chosen) is not None,
        is_of_simulation=True,
        equation=(
            "Δ = δ(fit) − δ(truth), minus its best shift, roll and scale; right: with the "
            "detectors' places, rotations, pitches and own distortions"
        ),
    ),
)
