"""Residual vectors on a detector or the whole focal plane (paper, "residual:detector")."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, Glyphs, Tooltips, framed, message
from plateviz.figures.glyphs import paths
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.elements.arrows import (
    Field,
    arrows,
    automatic_scale,
    key,
    rms_length,
    round_125,
)
from plateviz.plots.elements.focal_plane import XLABEL, YLABEL, detector_outlines
from plateviz.plots.elements.style import ARROW_LIMIT
from plateviz.plots.elements.units import angle_text
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.tables.residuals import binned_vectors, residual_map
from solver.data.instrument import Detector, Instrument
from solver.data.plural import plural
from solver.units import UM_PER_MM

_BINS_ON_DETECTOR, _BINS_ON_FOCAL_PLANE = 16, 24
_LEAST_SHARE = 0.25
_MARGIN = 1.08
_HOVER_VALUES = [
    ("residual x", "@{residual_x_mpix}{0.00} mpix = @{residual_x_mas}{0.000} mas"),
    ("residual y", "@{residual_y_mpix}{0.00} mpix = @{residual_y_mas}{0.000} mas"),
]


def plot_residual_map(
    table: pd.DataFrame,
    detector: Detector | Instrument,
    *,
    arrow_scale: float | None = None,
    width: int = FRAME_WIDTH,
) -> Figure:
    """Draw residual vectors to a stated scale, or their means in bins if there are over 2,000.

    Parameters
    ----------
    table : `tables.residual_map`, of one detector in pix or of all in mm
    detector : the detector of the table, or the instrument for all detectors
    arrow_scale : drawn length over true length; None for a round number that makes the
        rms arrow about 4 % of the width
    width : of the frame, screen pixels
    """
    unit = "mm" if isinstance(detector, Instrument) else "pix"
    xlabel, ylabel = _axis_label(detector, "x"), _axis_label(detector, "y")
    if table.empty:
        text = "No measurements"
        return message(_title(detector), text, width=width, xlabel=xlabel, ylabel=ylabel)
    field = _field(detector)
    shown, binning = _thinned(table, detector, field)
    scale = arrow_scale or automatic_scale(shown, field)
    field = field.holding(shown, scale)
    length, length_text = _key(shown, unit)
    return framed(
        [
            _outlines(detector),
            *arrows(shown, scale=scale, field=field, colour="mark", hover=_hover(shown)),
            *key(length, length_text, scale=scale, field=field),
        ],
        title=_title(detector),
        subtitle=f"{_shown_exposures(table)}. {binning}\n"
        f"Arrows enlarged {scale:,.12g} times; key: {length_text}",
        x=Axis(xlabel, field.x),
        y=Axis(ylabel, field.ylim),
        width=width,
    )


def _title(detector: Detector | Instrument) -> str:
    if isinstance(detector, Instrument):
        return "Residuals on the focal plane, measured minus predicted"
    return f"Residuals on detector {detector.detector_id}, measured minus predicted"


def _axis_label(detector: Detector | Instrument, axis: str) -> str:
    if isinstance(detector, Instrument):
        return {"x": XLABEL, "y": YLABEL}[axis]
    return f"detector {axis} (pix)"


def _field(detector: Detector | Instrument) -> Field:
    if isinstance(detector, Instrument):
        half = max(np.abs(d.corners_um()).max() for d in detector.detectors) / UM_PER_MM
        x = y = half
    else:
        x, y = 0.5 * detector.n_x, 0.5 * detector.n_y
    return Field((-_MARGIN * x, _MARGIN * x), (-_MARGIN * y, _MARGIN * y))


def _outlines(detector: Detector | Instrument) -> Glyphs:
    if isinstance(detector, Instrument):
        return detector_outlines(detector.detectors)
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)])
    return paths([0.5 * corners * (detector.n_x, detector.n_y)], name="outlines", color="line")


def _thinned(
    table: pd.DataFrame, detector: Detector | Instrument, field: Field
) -> tuple[pd.DataFrame, str]:
    """Return the vectors or their means in bins, and a text that describes them."""
    measurements = f"{len(table):,} {plural(len(table), 'measurement')}"
    if len(table) <= ARROW_LIMIT:
        return table, f"{measurements}, one arrow each"
    bins = _BINS_ON_FOCAL_PLANE if isinstance(detector, Instrument) else _BINS_ON_DETECTOR
    x, y = field.x[1] / _MARGIN, field.y[1] / _MARGIN
    means = binned_vectors(
        table, x_range=(-x, x), y_range=(-y, y), bins=bins, least_share=_LEAST_SHARE
    )
    return means, (
        f"{measurements}: mean residual in {len(means):,} {plural(len(means), 'bin')} of a "
        f"{bins} × {bins} grid, {means['n'].mean():.0f} in each on average"
    )


def _key(shown: pd.DataFrame, unit: str) -> tuple[float, str]:
    """Return the length of the key arrow in axis units, and as text."""
    mas_per_unit = float(shown["mas_per_unit"].mean())
    length = round_125(2.0 * rms_length(shown)) if rms_length(shown) > 0 else 1.0
    text = f"{length:g} pix" if unit == "pix" else f"{UM_PER_MM * length:g} µm"
    return length, f"{text} = {angle_text(length * mas_per_unit)}"


def _hover(shown: pd.DataFrame) -> Tooltips:
    if "id" in shown:
        return [("source", "@{id}"), ("exposure", "@{exposure}"), *_HOVER_VALUES]
    return [("measurements in the bin", "@{n}"), *_HOVER_VALUES]


def _shown_exposures(table: pd.DataFrame) -> str:
    names = table["exposure"].unique()
    return str(names[0]).capitalize() if len(names) == 1 else f"{len(names)} exposures"


def _plot(chosen: Chosen) -> Figure:
    detectors = {d.detector_id: d for d in chosen.instrument.detectors}
    shown = chosen.instrument if chosen.detector is None else detectors[chosen.detector]
    table, *others = (
        residual_map(
            one,
            chosen.instrument,
            exposures=chosen.exposures,
            detector_id=chosen.detector,
        )
        for one in (chosen.result, chosen.beside)
        if one is not None
    )
    # Beside another solution, both have the scale of the one with the larger residuals.
    beside = [one for one in (table, *others) if not one.empty] if others else []
    scale = min((_scale(one, shown) for one in beside), default=None)
    return plot_residual_map(table, shown, arrow_scale=scale)


def _scale(table: pd.DataFrame, detector: Detector | Instrument) -> float:
    field = _field(detector)
    return automatic_scale(_thinned(table, detector, field)[0], field)


DIAGNOSTICS = (
    Diagnostic(
        "residual-map",
        "Residual map",
        "Measured minus predicted position on the detector, for the shown exposures and "
        "detector. Good: directions without a pattern. Neighbouring arrows with a common "
        "direction mean distortion that the order does not describe.",
        OrbitWorkspace.RESIDUALS,
        20,
        _plot,
        follows_shown=True,
        is_key=True,
        equation="r = n(measured) − n(predicted), for x and y",
    ),
)
