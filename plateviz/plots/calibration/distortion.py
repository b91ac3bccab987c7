"""The fitted optical distortion as vectors on the focal plane."""

from collections.abc import Sequence

import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, framed, message
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.arrows import arrows, automatic_scale, key, rms_length, round_125
from plateviz.plots.elements.focal_plane import XLABEL, YLABEL, detector_outlines, field_about
from plateviz.plots.elements.units import angle_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.calibration import distortion
from plateviz.tables.rounded import rounded
from solver.data.instrument import Detector
from solver.units import UM_PER_MM

_TITLE = "Fitted distortion, distorted minus ideal position"
_HOVER = [
    ("at", "@{x}{0.00}, @{y}{0.00} mm"),
    ("x", "@{dx_um}{0.000} µm = @{dx_mas}{0.00} mas"),
    ("y", "@{dy_um}{0.000} µm = @{dy_mas}{0.00} mas"),
]
_MARGIN = 1.18


def plot_distortion(
    table: pd.DataFrame,
    *,
    detectors: Sequence[Detector] = (),
    arrow_scale: float | None = None,
    width: int = FRAME_WIDTH,
) -> Figure:
    """Draw the displacement by the distortion to a stated scale.

    Parameters
    ----------
    table : `tables.distortion`
    detectors : detectors to outline
    arrow_scale : drawn length over true length; None for a round number that makes the
        rms arrow about 4 % of the width
    width : of the frame, screen pixels
    """
    if table.empty:
        return message(_TITLE, "No distortion fitted", width=width, xlabel=XLABEL, ylabel=YLABEL)
    field = field_about(table, _MARGIN)
    scale = arrow_scale or automatic_scale(table, field)
    field = field.holding(table, scale)
    rms_um = UM_PER_MM * rms_length(table)
    length_um = round_125(2.0 * rms_um) if rms_um > 0 else 1.0
    mas = length_um / UM_PER_MM * float(table["mas_per_unit"].iloc[0])
    length = f"{length_um:g} µm = {angle_text(mas)}"
    return framed(
        [
            detector_outlines(detectors, "muted"),
            *arrows(table, scale=scale, field=field, colour="mark", hover=_HOVER),
            *key(length_um / UM_PER_MM, length, scale=scale, field=field),
        ],
        title=_TITLE,
        subtitle=f"Zero at the optical centre; rms {rounded(rms_um, 3)} µm.\n"
        f"Arrows enlarged {scale:,.12g} times; key: {length}",
        x=Axis(XLABEL, field.x),
        y=Axis(YLABEL, field.ylim),
        width=width,
    )


def _plot(chosen: Chosen) -> Figure:
    table, *others = (
        distortion(one, chosen.instrument)
        for one in (chosen.result, chosen.beside)
        if one is not None
    )
    fields = [(one, field_about(one, _MARGIN)) for one in (table, *others) if not one.empty]
    scale = min((automatic_scale(*one) for one in fields), default=None)
    return plot_distortion(table, detectors=chosen.instrument.detectors, arrow_scale=scale)


DIAGNOSTICS = (
    Diagnostic(
        "distortion",
        "Distortion",
        "Displacement on the focal plane by the fitted Legendre terms, zero at the optical centre. "
        "Good: a smooth pattern without strong growth towards the edges.",
        OrbitWorkspace.CALIBRATION,
        79,
        _plot,
        is_key=True,
        equation=(
            "δx = Σ A(k,j) P_k(x/s) P_j(y/s), 2 ≤ k + j ≤ order, minus its value at the "
            "centre; δy with B(k,j); Legendre polynomials P, scale s of the instrument"
        ),
    ),
)
