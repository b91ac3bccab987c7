"""A figure in another size."""

import math
from dataclasses import replace

from plateviz.figures.figure import MARGIN, Axis, Figure, Frame, Link, Ramp
from plateviz.figures.text_width import text_width
from plateviz.figures.theme import LABEL_SIZE, SMALL_SIZE
from plateviz.figures.words import words_of

# Screen pixels around a frame: label of the left axis, its shortest tick labels, margin on the
# right, colour bar.
_LEFT, _TICKS, _RIGHT, _BAR = 32, 34, 18, 72
# Toolbar, a line of the title, a line of the subtitle, the lower axis with its labels.
_TOOLBAR, _TITLE, _LINE, _BELOW = 18, 19, 15, 54
# A row of the legend, the mark of one of its labels.
_ROW, _MARK = 26, 32
_LEAST = 60
# Words that would leave a frame less than this share of its height are left out.
_SHARE = 0.55


def resized(figure: Figure, width: int, height: int, *, corner: int = 0) -> Figure:
    """Return the figure in a size that fills an area as far as the scales of its axes allow.

    Frames with equal scales of both axes keep them. Frames that share no x axis are arranged in
    as many columns as leave them largest. Subtitles or legends are left out where they would take
    much of the height.

    Parameters
    ----------
    width, height : of the area, with everything around the frames, screen pixels
    corner : width of what covers the upper right corner of the area, screen pixels
    """
    columns = [figure.columns]
    if figure.linked != "x":
        columns += range(1, len(figure) + 1)
    candidates = [_arranged(_free(figure, n, corner), n, width, height) for n in columns]
    return max(candidates, key=_least_side)


def _free(figure: Figure, columns: int, corner: int) -> Figure:
    """Return the figure with the corner left free by the title of the frame below it."""
    last = min(columns, len(figure)) - 1
    frames = (replace(f, corner=corner if n == last else 0) for n, f in enumerate(figure))
    return replace(figure, frames=tuple(frames))


def _arranged(figure: Figure, columns: int, width: int, height: int) -> Figure:
    room = (width // columns, height // math.ceil(len(figure) / columns))
    no_subtitle, no_legend = {"subtitle": ""}, {"legend_columns": 0}
    candidates = [
        _fitted([replace(one, **without) for one in figure], columns, figure.linked, room)
        for without in ({}, no_subtitle, no_legend, no_subtitle | no_legend)
    ]
    *wordy, bare = candidates
    enough = max(_LEAST, _SHARE * _least_height(bare))
    return next((one for one in wordy if _least_height(one) >= enough), bare)


def _fitted(frames: list[Frame], columns: int, linked: Link, room: tuple[int, int]) -> Figure:
    rows = [frames[first : first + columns] for first in range(0, len(frames), columns)]
    return Figure(tuple(one for row in rows for one in _fitted_row(row, *room)), columns, linked)


def _fitted_row(row: list[Frame], width: int, height: int) -> list[Frame]:
    """Return the frames of a row, whose titles, subtitles and legends are of one height."""
    frames = [_of_width(frame, max(_LEAST, width - _beside(frame)), width) for frame in row]
    # Words are wrapped to the frame, whose width may follow from its height.
    for _ in range(3):
        words = [words_of(frame) for frame in frames]
        title, subtitle = (max(map(len, lines)) for lines in zip(*words, strict=True))
        above = _TOOLBAR + _TITLE * title + _LINE * subtitle
        below = _BELOW + max(_rise(frame.x) + _ROW * _legend_rows(frame) for frame in frames)
        high = max(1, height - above - below)
        frames = [_of_height(frame, high, width) for frame in frames]
    return frames


def _of_height(frame: Frame, height: int, room: int) -> Frame:
    if frame.height is not None:
        return replace(frame, height=height)
    wide = max(1, round(height * frame.x.length / frame.y.length))
    return _of_width(frame, min(room - _beside(frame), wide), room)


def _of_width(frame: Frame, width: int, room: int) -> Frame:
    margin = MARGIN + max(0, (room - _beside(frame) - width) // 2)
    # A label is in the middle below the frame, and is cut off at the edge of the margin.
    fits = text_width(frame.x.label, LABEL_SIZE) < width + 2 * margin
    return replace(
        frame,
        x=replace(frame.x, label=frame.x.label if fits else ""),
        width=width,
        margin=margin,
        legend_columns=_legend_columns(frame, width + margin),
    )


def _least_side(figure: Figure) -> float:
    return min(min(frame.width, 2 * frame.frame_height) for frame in figure)


def _least_height(figure: Figure) -> float:
    return min(frame.frame_height for frame in figure)


def _beside(frame: Frame) -> int:
    ticks = max(_TICKS, round(_longest_tick(frame.y)) + 10)
    return _LEFT + ticks + _RIGHT + (_BAR if _has_bar(frame) else 0)


def _has_bar(frame: Frame) -> bool:
    looks = (look for glyphs in frame.glyphs for look in glyphs.looks.values())
    return any(isinstance(look, Ramp) and look.label is not None for look in looks)


def _rise(axis: Axis) -> int:
    """Return the height of turned labels, screen pixels."""
    return round(_longest_tick(axis) * math.sin(math.radians(axis.rotation)))


def _longest_tick(axis: Axis) -> float:
    return max((text_width(label, SMALL_SIZE) for _, label in axis.ticks or ()), default=0.0)


def _legend_columns(frame: Frame, width: int) -> int:
    labels = _labels(frame)
    if not frame.legend_columns or not labels:
        return frame.legend_columns
    widest = _MARK + max(text_width(label, SMALL_SIZE) for label in labels)
    return min(len(labels), max(1, int(width / widest)))


def _legend_rows(frame: Frame) -> int:
    return math.ceil(len(_labels(frame)) / frame.legend_columns) if frame.legend_columns else 0


def _labels(frame: Frame) -> set[str]:
    return set().union(*(glyphs.labels for glyphs in frame.glyphs))
