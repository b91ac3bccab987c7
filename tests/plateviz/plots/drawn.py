"""What a drawing is made of."""

import holoviews as hv
from bokeh.models import GlyphRenderer, Plot, Title


def figures_of(drawing):
    """Return its Bokeh figures, by their titles."""
    found = hv.render(drawing, backend="bokeh").select({"type": Plot})
    return sorted(found, key=lambda figure: figure.title.text)


def titles_of(figure):
    """Return the titles below the first."""
    return [title for title in figure.above if isinstance(title, Title)]


def subtitle_of(figure):
    return " ".join(title.text for title in titles_of(figure))


def sources_of(figure):
    """Return what its glyphs draw."""
    return [r.data_source for r in figure.renderers if isinstance(r, GlyphRenderer)]


def words_of(figure):
    """Return what stands on it."""
    return [s.data["text"][0] for s in sources_of(figure) if "text" in s.data]


def shafts_of(overlay):
    """Return the shafts of its arrows: before the two strokes of each head."""
    strokes = next(e for e in overlay if e.label == "arrows").dframe()
    return strokes[: len(strokes) // 3]
