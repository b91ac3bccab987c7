"""Texts inside a frame, made to fit its size."""

from dataclasses import replace

import numpy as np

from plateviz.figures.figure import MARGIN, MESSAGE, Axis, Frame, Glyphs
from plateviz.figures.text_width import cut_to, text_width, wrapped
from plateviz.figures.theme import TITLE_SIZE

# Texts in cells that are fewer may overlap in a few places, such as numbers of fields.
_FEW = 6
_MOST_OVERLAPPING = 0.1


def with_fitting_texts(frame: Frame) -> Frame:
    """Return a frame with its message wrapped, long texts cut, and no centred ones that overlap.

    The hover of the glyphs below such texts still has the numbers.
    """
    glyphs = tuple(_fitting(one, frame) if one.kind == "texts" else one for one in frame.glyphs)
    return replace(frame, glyphs=glyphs)


def _fitting(glyphs: Glyphs, frame: Frame) -> Glyphs:
    texts = glyphs.values("text")
    if glyphs.name == MESSAGE:
        lines = wrapped(str(texts[0]), frame.width - 2 * MARGIN, TITLE_SIZE)
        return _with_texts(glyphs, ["\n".join(lines)])
    # A single text is a key, whose number and unit belong together.
    if len(glyphs) > 1 and glyphs.looks.get("text_align") == "left":
        return _cut(glyphs, frame)
    if len(glyphs) > _FEW and _overlapping(glyphs, frame) > _MOST_OVERLAPPING:
        return _with_texts(glyphs, [""] * len(glyphs))
    return glyphs


def _cut(glyphs: Glyphs, frame: Frame) -> Glyphs:
    """Return texts that begin at their point, cut where the frame ends."""
    pixels = _pixels(glyphs)
    if pixels is None:
        return glyphs
    rooms = frame.width - _places(frame.x, glyphs.values("x"), frame.width)
    texts = [str(text) for text in glyphs.values("text")]
    cut = [cut_to(text, room, pixels) for text, room in zip(texts, rooms, strict=True)]
    return glyphs if cut == texts else _with_texts(glyphs, cut)


def _pixels(glyphs: Glyphs) -> int | None:
    """Return the size of the font, screen pixels; None if the texts differ in it."""
    size = glyphs.looks.get("text_font_size")
    return int(size.removesuffix("px")) if isinstance(size, str) else None


def _with_texts(glyphs: Glyphs, texts: list[str]) -> Glyphs:
    column = np.array(texts, dtype=object)
    return replace(glyphs, columns={**glyphs.columns, glyphs.at["text"]: column})


def _overlapping(glyphs: Glyphs, frame: Frame) -> float:
    """Return the share of centred texts that overlap the next one to the right."""
    pixels = _pixels(glyphs)
    if glyphs.looks.get("text_align") != "center" or pixels is None:
        return 0.0
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
