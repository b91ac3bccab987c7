"""A figure in another size."""

import math
from dataclasses import replace

from plateviz.figures.figure import MARGIN, Axis, Figure, Frame, Ramp
from plateviz.figures.text_width import text_width
from plateviz.figures.theme import LABEL_SIZE, SMALL_SIZE, TITLE_SIZE
from plateviz.figures.words import words_of

# Screen pixels around a frame: label of the left axis, its shortest tick labels, margin on the
# right, colour bar.
_LEFT, _TICKS, _RIGHT, _BAR = 32, 34, 18, 72
# A line of the title, the toolbar beside the subtitle, space around its lines, one of these lines,
# the lower axis with its labels.
_TITLE, _TOOLBAR, _SPACE, _LINE, _BELOW = 19, 38, 18, 15, 54
# A row of the legend, the mark of one of its labels.
_ROW, _MARK = 26, 32
_LEAST = 60
# Words that would leave a frame less than this share of its height are left out.
_SHARE = 0.55
# How much higher a frame is that is clearly larger.
_GAIN = 1.12


def resized(figure: Figure, width: int, height: int, *, corner: int = 0) -> Figure:
    """Return the figure in a size that fills an area as far as the scales of its axes allow.

    Frames with equal scales of both axes keep them. Frames that share no x axis are arranged in
    as many columns as leave them largest. Those that are narrower than the area are in its middle,
    or to its left where their words need the room. Subtitles or legends are left out where they
    would take much of the height.

    Parameters
    ----------
    width, height : of the area, with everything around the frames, screen pixels
    corner : width of what covers the upper right corner of the area, screen pixels
    """
    columns = [figure.columns]
    if figure.linked != "x":
        columns += range(1, len(figure) + 1)
    candidates = [
        _arranged(_free(figure, n, corner), n, width, height) for n in dict.fromkeys(columns)
    ]
    return max(candidates, key=_least_side)


def _free(figure: Figure, columns: int, corner: int) -> Figure:
    """Return the figure with the corner left free by the title of the frame below it."""
    last = min(columns, len(figure)) - 1
    frames = (replace(f, corner=corner if n == last else 0) for n, f in enumerate(figure))
    return replace(figure, frames=tuple(frames))


def _arranged(figure: Figure, columns: int, width: int, height: int) -> Figure:
    room = (width // columns, height // math.ceil(len(figure) / columns))
    frames = replace(figure, columns=columns)
    best = _wordy(frames, room, is_leaning=False)
    if any(frame.height is None for frame in figure):
        leaning = _wordy(frames, room, is_leaning=True)
        best = leaning if _is_better(leaning, best) else best
    return best


def _is_better(one: Figure, other: Figure) -> bool:
    """Return whether a figure has more words than another, or as many and clearly larger frames."""
    more = _words(one) - _words(other)
    return more > 0 or (more == 0 and _least_height(one) > _GAIN * _least_height(other))


def _words(figure: Figure) -> int:
    """Return how many frames have a subtitle, and how many a legend."""
    return sum(bool(frame.subtitle) + bool(frame.legend_columns) for frame in figure)


def _wordy(figure: Figure, room: tuple[int, int], *, is_leaning: bool) -> Figure:
    """Return the figure with its words above, without those that would take much of the height."""
    no_subtitle, no_legend = {"subtitle": ""}, {"legend_columns": 0}
    candidates = [
        _fitted([replace(one, **without) for one in figure], figure, room, is_leaning=is_leaning)
        for without in ({}, no_subtitle, no_legend, no_subtitle | no_legend)
    ]
    *wordy, bare = candidates
    enough = max(_LEAST, _SHARE * _least_height(bare))
    return next((one for one in wordy if _least_height(one) >= enough), bare)


def _fitted(
    frames: list[Frame], figure: Figure, room: tuple[int, int], *, is_leaning: bool
) -> Figure:
    """Return a figure of `frames`, arranged as `figure`."""
    first = range(0, len(frames), figure.columns)
    rows = [frames[number : number + figure.columns] for number in first]
    fitted = (one for row in rows for one in _fitted_row(row, *room, is_leaning=is_leaning))
    return replace(figure, frames=tuple(fitted))


def _fitted_row(row: list[Frame], width: int, height: int, *, is_leaning: bool) -> list[Frame]:
    """Return the frames of a row, whose titles, subtitles and legends are of one height.

    Parameters
    ----------
    is_leaning : whether all the room that is left is to the right of a frame, for its words, and
        the frame is not in the middle
    """
    widest = [max(_LEAST, width - _beside(frame)) for frame in row]
    frames = [_of_width(*one, width) for one in zip(row, widest, strict=True)]
    # Words are wrapped to the frame, whose width may follow from its height.
    for _ in range(3 if any(frame.height is None for frame in row) else 1):
        words = [words_of(frame) for frame in frames]
        title, subtitle = (max(map(len, lines)) for lines in zip(*words, strict=True))
        above = _TITLE * title + max(_TOOLBAR, _SPACE + _LINE * subtitle)
        below = _BELOW + max(_rise(frame.x) + _ROW * _legend_rows(frame) for frame in frames)
        high = max(1, height - above - below)
        frames = [_of_height(frame, high, width, is_leaning=is_leaning) for frame in frames]
    return [_towards_the_middle(frame) for frame in frames] if is_leaning else frames


def _towards_the_middle(frame: Frame) -> Frame:
    """Return a frame at the left of its room, moved as far to the middle as its words allow."""
    words = words_of(frame)
    needed = max(
        *(text_width(line, TITLE_SIZE, is_bold=True) + frame.corner for line in words.title),
        *(text_width(line, SMALL_SIZE) for line in words.subtitle),
        frame.legend_columns * _legend_entry(frame),
        (text_width(frame.x.label, LABEL_SIZE) + frame.width) / 2,
    )
    at_least = MARGIN + (frame.margin - MARGIN) // 2
    margin = min(frame.margin, max(at_least, math.ceil(needed) - frame.width))
    return replace(frame, margin=margin, indent=frame.margin - margin)


def _of_height(frame: Frame, height: int, room: int, *, is_leaning: bool) -> Frame:
    if frame.height is not None:
        return replace(frame, height=height)
    wide = max(1, round(height * frame.x.length / frame.y.length))
    return _of_width(frame, min(room - _beside(frame), wide), room, is_leaning=is_leaning)


def _of_width(frame: Frame, width: int, room: int, *, is_leaning: bool = False) -> Frame:
    left = max(0, room - _beside(frame) - width)
    indent = 0 if is_leaning else left // 2
    margin = MARGIN + left - indent
    # A label is in the middle below the frame, and is cut off at either edge.
    reach = min(margin, _LEFT + _TICKS + indent)
    fits = text_width(frame.x.label, LABEL_SIZE) < width + 2 * reach
    return replace(
        frame,
        x=replace(frame.x, label=frame.x.label if fits else ""),
        width=width,
        margin=margin,
        indent=indent,
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
    return min(len(labels), max(1, int(width / _legend_entry(frame))))


def _legend_entry(frame: Frame) -> float:
    """Return the width of a column of the legend, screen pixels."""
    widths = (text_width(label, SMALL_SIZE) for label in _labels(frame))
    return _MARK + max(widths, default=0.0)


def _legend_rows(frame: Frame) -> int:
    return math.ceil(len(_labels(frame)) / frame.legend_columns) if frame.legend_columns else 0


def _labels(frame: Frame) -> set[str]:
    return set().union(*(glyphs.labels for glyphs in frame.glyphs))
