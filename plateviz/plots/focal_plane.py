"""What figures of the focal plane share: labels of the axes, outlines of the detectors."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from plateviz.figures.figure import Glyphs
from plateviz.figures.glyphs import paths
from plateviz.plots.arrows import Field
from solver.data.instrument import Detector

XLABEL, YLABEL = "focal-plane x (mm)", "focal-plane y (mm)"


def detector_outlines(detectors: Iterable[Detector], colour: str = "line") -> Glyphs:
    """Return the outlines of detectors, mm."""
    outlines = [d.corners_um()[[0, 1, 2, 3, 0]] / 1000.0 for d in detectors]
    return paths(outlines, name="outlines", color=colour)


def field_about(table: pd.DataFrame, margin: float) -> Field:
    """Return the square about the centre that reaches beyond all `x` and `y` by a factor."""
    half = margin * float(np.abs(table[["x", "y"]].to_numpy()).max())
    return Field((-half, half), (-half, half))
