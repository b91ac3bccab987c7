"""The words and arrows of a frame, the Bokeh plots of a figure, and what they show."""

import numpy as np
import pandas as pd
from bokeh.models import GlyphRenderer

from plateviz.figures.bokeh_figure import BokehFigure


def subtitle_of(frame):
    """Return its subtitle in one line."""
    return " ".join(frame.subtitle.split())


def texts_of(frame):
    """Return the texts inside it."""
    return [text for one in frame.glyphs if one.kind == "texts" for text in one.values("text")]


def shafts_of(frame):
    """Return x0, y0, x1, y1 of the shafts of its arrows; two strokes of each head follow them."""
    strokes = pd.DataFrame(dict(frame["arrows"].columns))
    return strokes[: len(strokes) // 3]


def plots_of(figure, theme="light"):
    """Return its Bokeh plots, in the order of its frames."""
    return [frame.plot for frame in BokehFigure(figure, theme).frames]


def renderers_of(plot):
    """Return the glyphs that it shows."""
    return [r for r in plot.renderers if isinstance(r, GlyphRenderer) and r.visible]


def contrast(one, other):
    """Return the contrast ratio of WCAG 2 between two colours."""
    levels = []
    for colour in (one, other):
        rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        levels.append(float(linear @ (0.2126, 0.7152, 0.0722)))
    return (max(levels) + 0.05) / (min(levels) + 0.05)
