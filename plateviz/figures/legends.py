"""Legends of frames: which have one, and in how many columns."""

import math
from dataclasses import replace

from plateviz.figures.figure import Figure, Frame
from plateviz.figures.text_width import text_width
from plateviz.figures.theme import SMALL_SIZE

# The mark of a label, screen pixels.
_MARK = 32


def with_shared_legends(figure: Figure, columns: int) -> Figure:
    """Return the figure with one legend for all frames that have the same labels.

    It is below the first of them in the last row that has any: a legend below each would say the
    same.
    """
    alike: dict[frozenset[str], list[int]] = {}
    for n, frame in enumerate(figure):
        if frame.legend_columns:
            alike.setdefault(frozenset(_labels(frame)), []).append(n)
    keepers = {}
    for numbers in alike.values():
        keeper = next(n for n in numbers if n // columns == numbers[-1] // columns)
        keepers[keeper] = max(figure[n].legend_columns for n in numbers)
    frames = [replace(frame, legend_columns=keepers.get(n, 0)) for n, frame in enumerate(figure)]
    return replace(figure, frames=tuple(frames))


def without_legend(figure: Figure) -> Figure:
    """Return the figure without its legends."""
    return replace(figure, frames=tuple(replace(frame, legend_columns=0) for frame in figure))


def legend_columns_that_fit(frame: Frame) -> int:
    """Return the number of columns of the legend of a frame of its width; zero for no legend."""
    labels = _labels(frame)
    if not frame.legend_columns or not labels:
        return frame.legend_columns
    # A label that is wider than this would be cut off.
    return min(len(labels), int(frame.words_width / _entry(frame)))


def legend_rows(frame: Frame) -> int:
    """Return the number of rows of the legend of a frame."""
    return math.ceil(len(_labels(frame)) / frame.legend_columns) if frame.legend_columns else 0


def _entry(frame: Frame) -> float:
    """Return the width of a column of the legend, screen pixels."""
    widths = (text_width(label, SMALL_SIZE) for label in _labels(frame))
    return _MARK + max(widths, default=0.0)


def _labels(frame: Frame) -> set[str]:
    return set().union(*(glyphs.labels for glyphs in frame.glyphs))
