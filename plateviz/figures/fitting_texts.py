"""Texts inside a frame, made to fit its size."""

from dataclasses import replace

import numpy as np

from plateviz.figures.figure import MARGIN, MESSAGE, Axis, Frame, Glyphs
from plateviz.figures.text_width import text_width, wrapped
from plateviz.figures.theme import TITLE_SIZE

# Texts in cells that are fewer may overlap in a few places, such as numbers of fields.
_FEW = 6
_MOST_OVERLAPPING = 0.1


def with_fitting_texts(frame: Frame) -> Frame:
    """Return a frame with its message wrapped, and without centred texts that would overlap.

    The hover of the glyphs below such texts still has the numbers.
    """
    glyphs = tuple(_fitting(one, frame) if one.kind == "texts" else one for one in frame.glyphs)
    return replace(frame, glyphs=glyphs)


def _fitting(glyphs: Glyphs, frame: Frame) -> Glyphs:
    texts = glyphs.values("text")
    if glyphs.name == MESSAGE:
        lines = wrapped(str(texts[0]), frame.width - 2 * MARGIN, TITLE_SIZE)
        return _with_texts(glyphs, ["\n".join(lines)])
    if len(glyphs) > _FEW and _overlapping(glyphs, frame) > _MOST_OVERLAPPING:
        return _with_texts(glyphs, [""] * len(glyphs))
    return glyphs


def _with_texts(glyphs: Glyphs, texts: list[str]) -> Glyphs:
    column = np.array(texts, dtype=object)
    return replace(glyphs, columns={**glyphs.columns, glyphs.at["text"]: column})


def _overlapping(glyphs: Glyphs, frame: Frame) -> float:
    """Return the share of centred texts that overlap the next one to the right."""
    size = glyphs.looks.get("text_font_size")
    if glyphs.looks.get("text_align") != "center" or not isinstance(size, str):
        return 0.0
    pixels = int(size.removesuffix("px"))
    widths = np.array([text_width(str(text), pixels) for text in glyphs.values("text")])
    x = _places(frame.x, glyphs.values("x"), frame.width)
    y = _places(frame.y, glyphs.values("y"), frame.frame_height)
    order = np.lexsort((x, y))
    x, y, widths = x[order], y[order], widths[order]
    is_row = np.abs(np.diff(y)) < 1.0
    is_near = np.diff(x) < 0.5 * (widths[1:] + widths[:-1])
    return float(np.mean(is_row & is_near))


def _places(axis: Axis, values: np.ndarray, length: int) -> np.ndarray:
    """Return where values are along an axis, screen pixels."""
    start, end = axis.limits
    if axis.is_log:
        start, end, values = np.log(start), np.log(end), np.log(values)
    return np.abs(values - start) / abs(end - start) * length
