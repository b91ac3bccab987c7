"""Colours, marks and limits that several plots share."""

from collections.abc import Mapping
from types import MappingProxyType

from plateviz.figures.figure import By
from plateviz.tables.sources import ARTIFICIAL, NON_REFERENCE, REFERENCE

ROW_LIMIT = 20_000
"""Number of glyphs above which a plot is rasterised or reduced."""
ARROW_LIMIT = 2_000
"""Number of arrows above which the mean arrow of each bin is drawn."""
PANEL_WIDTH = 340
"""Width of a frame beside another, screen pixels."""

# From the Okabe-Ito palette, which is distinct in all common colour-vision deficiencies, with
# lightness adjusted for a contrast above 3 to 1 on both backgrounds. Marker shapes differ, too.
CLASS_COLOURS: Mapping[str, str] = MappingProxyType(
    {NON_REFERENCE: "#4291d2", ARTIFICIAL: "#12a37b", REFERENCE: "#e4602a"}
)
_CLASS_MARKERS = {NON_REFERENCE: "circle", ARTIFICIAL: "triangle", REFERENCE: "x"}
_CLASS_SIZES = {NON_REFERENCE: 4.0, ARTIFICIAL: 6.5, REFERENCE: 7.0}
COLOUR_OF_CLASS = By("source_class", CLASS_COLOURS)
MARKER_OF_CLASS = By("source_class", _CLASS_MARKERS)
SIZE_OF_CLASS = By("source_class", _CLASS_SIZES)
SERIES_COLOURS = ("#4291d2", "#e4602a", "#12a37b", "#b98a00", "#b565a7", "#7a8793")
