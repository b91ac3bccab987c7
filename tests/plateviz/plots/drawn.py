"""The Bokeh figures, titles, sources and texts of a HoloViews object."""

import holoviews as hv
from bokeh.models import GlyphRenderer, Plot, Title


def figures_of(drawing):
    """Return its Bokeh figures, sorted by title."""
    found = hv.render(drawing, backend="bokeh").select({"type": Plot})
    return sorted(found, key=lambda figure: figure.title.text)


def titles_of(figure):
    """Return the titles below the main title."""
    return [title for title in figure.above if isinstance(title, Title)]


def subtitle_of(figure):
    return " ".join(title.text for title in titles_of(figure))


def sources_of(figure):
    """Return the data sources of its glyphs."""
    return [r.data_source for r in figure.renderers if isinstance(r, GlyphRenderer)]


def texts_of(figure):
    """Return the texts inside its frame."""
    return [s.data["text"][0] for s in sources_of(figure) if "text" in s.data]


def shafts_of(overlay):
    """Return the shafts of its arrows; the two strokes of each head follow them."""
    strokes = next(e for e in overlay if e.label == "arrows").dframe()
    return strokes[: len(strokes) // 3]
