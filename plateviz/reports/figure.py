"""A figure of a report as a Bokeh document: small, the same bytes every time, in either theme."""

import gzip
import json
from base64 import b64encode

import holoviews as hv
from bokeh.document import Document

from plateviz.plots.theme import theme_of

_WITH_BACKGROUND = ("Figure", "Plot")
_BACKGROUNDS = ("background_fill_color", "border_fill_color")
# Dark colours of a page are put in the place of these.
THEME = "light"


def packed_document(element: hv.core.Dimensioned) -> str:
    """Return the Bokeh document of a picture: JSON, compressed, as text."""
    document = Document()
    document.add_root(hv.render(element, backend="bokeh"))
    content = _settled(document.to_json(deferred=False))
    text = json.dumps(content, separators=(",", ":"))
    return b64encode(gzip.compress(text.encode(), compresslevel=9, mtime=0)).decode()


def dark_colours() -> dict[str, object]:
    """Return what a page makes a light figure dark with.

    Returns
    -------
    `colours`, light -> dark; `palettes`, pairs of a light and a dark one
    """
    light, dark = theme_of("light"), theme_of("dark")
    names = ("background", "text", "muted", "grid", "line", "mark")
    return {
        "colours": {getattr(light, name): getattr(dark, name) for name in names},
        "palettes": [
            [light.count_palette, dark.count_palette],
            [light.share_palette, dark.share_palette],
        ],
    }


def _settled(content: object) -> object:
    """Return the document with what Bokeh leaves open.

    Its models are counted from one, where Bokeh counts all that a process draws; and its plots
    say their background, where Bokeh leaves out a white one.
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
