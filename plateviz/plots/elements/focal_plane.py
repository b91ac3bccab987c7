"""What figures of the focal plane share: labels of the axes, outlines of the detectors."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from plateviz.figures.figure import Glyphs
from plateviz.figures.glyphs import paths
from plateviz.plots.elements.arrows import Field
from solver.data.instrument import Detector
from solver.units import UM_PER_MM

XLABEL, YLABEL = "focal-plane x (mm)", "focal-plane y (mm)"


def detector_outlines(detectors: Iterable[Detector], colour: str = "line") -> Glyphs:
    """Return the outlines of detectors, mm; those of selected detectors stand out."""
    shown = list(detectors)
    outlines = [d.corners_um()[[0, 1, 2, 3, 0]] / UM_PER_MM for d in shown]
    drawn = paths(outlines, name="outlines", color=colour)
    return of_detectors(drawn, [d.detector_id for d in shown])


def of_detectors(outlines: Glyphs, detector_ids: Sequence[int]) -> Glyphs:
    """Return outlines that belong to detectors, by which they are selected."""
    columns = {**outlines.columns, "detector_id": np.array(detector_ids, dtype=np.int64)}
    return replace(outlines, columns=columns)


def field_about(table: pd.DataFrame, margin: float) -> Field:
    """Return the square about the centre that reaches beyond all `x` and `y` by a factor."""
    half = margin * float(np.abs(table[["x", "y"]].to_numpy()).max())
    return Field((-half, half), (-half, half))
