"""A figure of a report as a compressed, reproducible Bokeh document, for both themes."""

import gzip
import json
from base64 import b64encode

from bokeh.document import Document

from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.figure import Figure
from plateviz.figures.theme import theme_of

_WITH_BACKGROUND = ("Figure", "Plot")
_BACKGROUNDS = ("background_fill_color", "border_fill_color")
# Documents are in this theme; a dark page replaces its colours.
THEME = "light"


def packed_document(figure: Figure, theme: str = THEME) -> str:
    """Return the Bokeh document of a figure as text: base64 of compressed JSON."""
    document = Document()
    document.add_root(BokehFigure(figure, theme).model)
    content = _normalised(document.to_json(deferred=False))
    text = json.dumps(content, separators=(",", ":"))
    return b64encode(gzip.compress(text.encode(), compresslevel=9, mtime=0)).decode()


def dark_colours() -> dict[str, object]:
    """Return the colours that a page replaces in a light figure for the dark theme.

    Returns
    -------
    `colours`, light -> dark; `palettes`, pairs of a light and a dark palette
    """
    light, dark = theme_of("light"), theme_of("dark")
    names = ("background", "text", "muted", "grid", "line", "mark")
    return {
        "colours": {getattr(light, name): getattr(dark, name) for name in names},
        "palettes": [
            [light.count_palette, dark.count_palette],
            [light.share_palette, dark.share_palette],
            [light.difference_palette, dark.difference_palette],
        ],
    }


def _normalised(content: object) -> object:
    """Return the document with reproducible model ids and explicit backgrounds.

    Model ids are counted from one, because Bokeh counts over all documents of a process. Plots
    have an explicit background, because Bokeh leaves out white.
    """
    numbers: dict[str, str] = {}

    def walk(part: object) -> object:
        if isinstance(part, dict):
            walked = {
                key: number(value) if key == "id" else walk(value) for key, value in part.items()
            }
            return _with_background(walked) if walked.get("name") in _WITH_BACKGROUND else walked
        return [walk(value) for value in part] if isinstance(part, list | tuple) else part

    def number(value: object) -> object:
        if not isinstance(value, str):
            return walk(value)
        return numbers.setdefault(value, f"m{len(numbers) + 1}")

    return walk(content)


def _with_background(model: dict[str, object]) -> dict[str, object]:
    attributes = model.get("attributes")
    if not isinstance(attributes, dict):
        return model
    white = dict.fromkeys(_BACKGROUNDS, theme_of(THEME).background)
    return {**model, "attributes": {**white, **attributes}}
