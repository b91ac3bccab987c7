"""Difference between the distortions of two solutions as vectors on the focal plane."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import pandas as pd

from plateviz.figures.figure import (
    FRAME_WIDTH,
    Axis,
    Figure,
    framed,
    message,
    side_by_side,
)
from plateviz.plots.diagnostic import TO_COMPARE, Chosen, Diagnostic
from plateviz.plots.elements.arrows import (
    Field,
    arrows,
    automatic_scale,
    key,
    rms_length,
    round_125,
)
from plateviz.plots.elements.focal_plane import XLABEL, YLABEL, detector_outlines, field_about
from plateviz.plots.elements.units import angle_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.distortion_comparison import ALONE, TOGETHER, distortion_comparison
from plateviz.tables.rounded import rounded
from solver.data.instrument import Detector
from solver.units import NM_PER_UM, UM_PER_MM

_TITLE = "Difference of the distortion, B minus A"
_TITLES = {ALONE: _TITLE, TOGETHER: "Difference of distortion and detectors, B minus A"}
_HOVER = [
    ("at", "@{x}{0.00}, @{y}{0.00} mm, detector @{detector_id}"),
    ("x", "@{dx_um}{0.00000} µm = @{dx_mas}{0.0000} mas"),
    ("y", "@{dy_um}{0.00000} µm = @{dy_mas}{0.0000} mas"),
]
_MARGIN = 1.2


def plot_distortion_comparison(
    table: pd.DataFrame,
    *,
    detectors: Sequence[Detector] = (),
    titles: Mapping[str, str] = MappingProxyType(_TITLES),
    width: int = FRAME_WIDTH,
) -> Figure:
    """Draw the difference of the distortion alone, and of distortion and detectors, to scale.

    Parameters
    ----------
    table : `tables.distortion_comparison`
    detectors : detectors to outline
    titles : part of the table -> title of its panel
    width : of each panel's frame, screen pixels
    """
    if table.empty:
        text = "No detector has measurements in both solutions"
        return message(_TITLE, text, width=width, xlabel=XLABEL, ylabel=YLABEL)
    parts = [(str(part), rows) for part, rows in table.groupby("part", sort=False)]
    area = field = field_about(table, _MARGIN)
    for _, rows in parts:
        field = field.holding(rows, automatic_scale(rows, area))
    panels = [
        _panel(rows, titles[part], detectors, automatic_scale(rows, area), field, width)
        for part, rows in parts
    ]
    return side_by_side(panels, columns=2)


def _panel(
    rows: pd.DataFrame,
    title: str,
    detectors: Sequence[Detector],
    scale: float,
    field: Field,
    width: int,
) -> Figure:
    rms = rms_length(rows)
    length = round_125(2.0 * rms)
    mas_per_mm = float(rows["mas_per_unit"].iloc[0])
    length_text = f"{_length(UM_PER_MM * length)} = {angle_text(length * mas_per_mm)}"
    return framed(
        [
            detector_outlines(detectors, "muted"),
            *arrows(rows, scale=scale, field=field, colour="mark", hover=_HOVER),
            *key(length, length_text, scale=scale, field=field),
        ],
        title=title,
        subtitle=f"rms {_length(UM_PER_MM * rms)} = {angle_text(rms * mas_per_mm)}"
        f"{_unmeasured(rows, detectors)}; {_removed(rows)}{_left_out(rows)}\n"
        f"Arrows enlarged {scale:,.12g} times; key: {length_text}",
        x=Axis(XLABEL, field.x),
        y=Axis(YLABEL, field.ylim),
        width=width,
    )


def _unmeasured(rows: pd.DataFrame, detectors: Sequence[Detector]) -> str:
    known = set(rows["detector_id"])
    others = [str(one.detector_id) for one in detectors if one.detector_id not in known]
    named = f"detector{'s' if others[1:] else ''} {', '.join(others)}"
    return f" without {named}, of which there are no measurements" if others else ""


def _removed(rows: pd.DataFrame) -> str:
    shift, roll, scale = (
        float(np.abs(rows[name].iloc[0])) for name in ("shift_um", "roll_arcsec", "scale_ppm")
    )
    return f"removed: shift {_length(shift)}, roll {rounded(roll)} arcsec, scale {scale:,.2f} ppm"


def _left_out(rows: pd.DataFrame) -> str:
    left_out = rows["left_out"].iloc[0]
    return f"; not compared: {left_out}" if left_out else ""


def _length(um: float) -> str:
    """Return a length to two digits or more: "12 µm", "0.05 nm"."""
    return f"{rounded(um, 3)} µm" if um >= 0.001 or um == 0.0 else f"{rounded(NM_PER_UM * um)} nm"


def _plot(chosen: Chosen) -> Figure:
    if chosen.other is None:
        return message(_TITLE, f"How the distortion differs between (A) and (B). {TO_COMPARE}")
    table = distortion_comparison(chosen.other, chosen.result, chosen.instrument)
    return plot_distortion_comparison(table, detectors=chosen.instrument.detectors)


DIAGNOSTICS = (
    Diagnostic(
        "distortion-comparison",
        "Comparison of two distortions",
        "The distortion of the current solution (B) minus that of the previous one (A), left, and "
        "the same with the places, rotations, pitches and own distortions of the detectors, right: "
        "means over the exposures. A common shift, roll and scale are removed, because pointing, "
        "roll and focal length absorb them. Good: on the right, differences well below the "
        "uncertainty of the positions. What is on the left alone has moved from the distortion to "
        "the detectors and does no harm.",
        OrbitWorkspace.ORDERS,
        87,
        _plot,
        is_wide=True,
        has_data=lambda chosen: chosen.other is not None,
        equation=(
            "Δ = δ(B) − δ(A), minus its best shift, roll and scale; right: with the "
            "detectors' places, rotations, pitches and own distortions"
        ),
    ),
)
