"""FigurePainting: lets the browser paint figures in a fraction of the time."""

from pathlib import Path

import panel as pn


class FigurePainting(pn.custom.JSComponent):
    """An element without a size that changes how BokehJS paints all figures of the page.

    BokehJS fills and outlines each mark by itself, which takes 140 ms for the 32,000 marks of the
    Verdict. Here each look of a figure's many marks is drawn once, at 16 places within a pixel, and
    copied to where the marks are. BokehJS also asks the style sheets for colours and sizes of words
    and lines, for which the browser computes the styles of the page anew; figures have their own.
    And it lays out a plot again for each property that changes; here, once for those of a message.
    Of a zoom the server hears before the browser has painted the old marks between the new limits.
    """

    _esm = Path(__file__).with_suffix(".js").read_text(encoding="utf-8")
    _stylesheets = [":host { display: none; }"]
