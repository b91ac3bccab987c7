"""A figure in another size."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise, zip_longest
from typing import NamedTuple

from plateviz.figures.figure import MARGIN, Axis, Figure, Frame, Ramp
from plateviz.figures.fitting_texts import with_fitting_texts
from plateviz.figures.legends import (
    legend_columns_that_fit,
    legend_rows,
    with_shared_legends,
    without_legend,
)
from plateviz.figures.text_width import has_room_for_words, text_width, wrapped
from plateviz.figures.theme import LABEL_SIZE, SMALL_SIZE, TITLE_SIZE
from plateviz.figures.tick_count import longest_label
from plateviz.figures.words import words_of_row

# Screen pixels around a frame: label of the left axis, its shortest tick labels, margin on the
# right, colour bar.
_LEFT, _TICKS, _RIGHT, _BAR = 32, 34, 18, 72
# A line of the title, the toolbar beside the subtitle, space around its lines, one of these lines,
# the lower axis with its labels, the label of that axis, space below it.
_TITLE, _TOOLBAR, _SPACE, _LINE, _BELOW, _LABEL, _FREE = 19, 38, 18, 15, 48, 18, 8
# A row of the legend.
_ROW = 26
# Words that take height from a frame are left out where they would leave it less than this height,
# in screen pixels, or less than this share of what it has without them.
_ENOUGH, _SHARE = 100, 0.65
# Lines of the label of an axis, at most.
_X_LINES, _Y_LINES = 2, 3

Rows = list[list[Frame]]


class _Column(NamedTuple):
    """Room for the frames of a column, screen pixels."""

    left: int
    width: int


def resized(figure: Figure, width: int, height: int, *, corner: int = 0) -> Figure:
    """Return the figure in a size that fills an area as far as the scales of its axes allow.

    Frames with equal scales of both axes keep them. Frames that share no x axis are arranged in
    as many columns as leave them largest. Those that are narrower than the area are in its middle.
    The last lines of subtitles, or legends, are left out where they would take much of the height.
    An axis has no label that the next frame to the left or below repeats.

    Parameters
    ----------
    width, height : of the area, with everything around the frames, screen pixels
    corner : width of what covers the upper right corner of the area, screen pixels
    """
    columns = [figure.columns]
    if figure.linked != "x":
        columns += range(1, len(figure) + 1)
    arrangements = [
        _arranged(_free(figure, n, corner), n, width, height) for n in dict.fromkeys(columns)
    ]
    best, quality = arrangements[0].bare, -math.inf
    # Words take room: frames that are smaller without any hardly become the largest with them.
    for one in sorted(arrangements, key=lambda one: -_size(one.bare)):
        if _size(one.bare) > quality:
            wordy = _with_words(one, width, height)
            if _quality(wordy) > quality:
                best, quality = wordy, _quality(wordy)
    return best


class _Arrangement(NamedTuple):
    """Frames in a number of columns: with all words, not yet fitted, and without any, fitted."""

    whole: Figure
    bare: Figure


def _free(figure: Figure, columns: int, corner: int) -> Figure:
    """Return the figure with the corner left free by the title of the frame below it."""
    last = min(columns, len(figure)) - 1
    frames = (replace(f, corner=corner if n == last else 0) for n, f in enumerate(figure))
    return replace(figure, frames=tuple(frames))


def _arranged(figure: Figure, columns: int, width: int, height: int) -> _Arrangement:
    whole = replace(with_shared_legends(figure, columns), columns=columns)
    bare = _with_lines_of_subtitle(without_legend(whole), 0)
    return _Arrangement(whole, _fitted(bare, width, height))


def _with_words(arrangement: _Arrangement, width: int, height: int) -> Figure:
    """Return the figure with its words, without those that would take much of the height."""
    whole, bare = arrangement
    least = _least_height(bare)
    enough = min(least, max(_ENOUGH, _SHARE * least))
    lines = max(len(frame.subtitle.splitlines()) for frame in whole)
    has_legend = any(frame.legend_columns for frame in whole)
    candidates = [
        (one, count)
        for one in ([whole, without_legend(whole)] if has_legend else [whole])
        for count in reversed(range(lines + 1))
    ]
    # The last one has no words at all.
    wordy = (
        _fitted(_with_lines_of_subtitle(one, count), width, height)
        for one, count in candidates[:-1]
    )
    return next((one for one in wordy if _least_height(one) >= enough), bare)


def _with_lines_of_subtitle(figure: Figure, count: int) -> Figure:
    """Return the figure with the first lines of the subtitle of each frame."""
    subtitles = ["\n".join(frame.subtitle.splitlines()[:count]) for frame in figure]
    frames = zip(figure, subtitles, strict=True)
    return replace(figure, frames=tuple(replace(frame, subtitle=one) for frame, one in frames))


def _fitted(figure: Figure, width: int, height: int) -> Figure:
    first = range(0, len(figure), figure.columns)
    rows = [list(figure.frames[number : number + figure.columns]) for number in first]
    labelled = _with_outer_labels(rows)
    fitted = _fitted_rows(labelled, width, height)
    # How long the label of a left axis may be follows from the height of its frame.
    wrapped_rows = [
        [replace(one, y=_with_lines(one.y, _y_room(row), _Y_LINES)) for one in frames]
        for frames, row in zip(labelled, fitted, strict=True)
    ]
    if _y_labels(wrapped_rows) != _y_labels(labelled):
        fitted = _fitted_rows(wrapped_rows, width, height)
    return replace(figure, frames=tuple(with_fitting_texts(one) for row in fitted for one in row))


def _y_labels(rows: Rows) -> list[str]:
    return [frame.y.label for row in rows for frame in row]


def _with_outer_labels(rows: Rows) -> Rows:
    """Return the frames, without labels that all of the next column or row repeat."""
    columns = list(zip_longest(*rows))
    without_x = [_is_alike(*pair, "x") for pair in pairwise(rows)] + [False]
    without_y = [False] + [_is_alike(right, left, "y") for left, right in pairwise(columns)]
    return [
        [
            replace(
                frame,
                x=replace(frame.x, label="" if is_x else frame.x.label),
                y=replace(frame.y, label="" if is_y else frame.y.label),
            )
            for frame, is_y in zip(row, without_y, strict=False)
        ]
        for row, is_x in zip(rows, without_x, strict=True)
    ]


def _is_alike(some: Sequence[Frame | None], others: Sequence[Frame | None], axis: str) -> bool:
    """Return whether each of some frames has a neighbour with the same label of an axis."""
    return len(some) <= len(others) and all(
        other is not None and getattr(one, axis).label == getattr(other, axis).label
        for one, other in zip(some, others, strict=False)
        if one is not None
    )


def _fitted_rows(rows: Rows, width: int, height: int) -> Rows:
    """Return frames of one height, those of a row with as many lines of words."""
    numbers = range(len(rows[0]))
    left, right = (
        [max(taken(row[n]) for row in rows if n < len(row)) for n in numbers]
        for taken in (_left, _right)
    )
    wide = max(1, (width - sum(left) - sum(right)) // len(left))
    columns = [_Column(taken, wide) for taken in left]
    rows = [
        [_of_width(frame, wide, column) for frame, column in zip(row, columns, strict=False)]
        for row in rows
    ]
    # Words are wrapped to the frame, whose width may follow from its height.
    for _ in range(3 if any(frame.height is None for row in rows for frame in row) else 1):
        around = sum(_above(row) + _below(row) for row in rows)
        high = max(1, (height - around) // len(rows))
        rows = [
            [_of_height(frame, high, column) for frame, column in zip(row, columns, strict=False)]
            for row in rows
        ]
    return rows


def _above(row: list[Frame]) -> int:
    (title, subtitle), *_ = words_of_row(row)
    return _TITLE * len(title) + max(_TOOLBAR, _SPACE + _LINE * len(subtitle))


def _below(row: list[Frame]) -> int:
    lines = max(frame.x.label.count("\n") if frame.x.label else -1 for frame in row)
    label = _LINE * lines if lines >= 0 else -_LABEL
    return _BELOW + label + max(_rise(f.x) + _ROW * legend_rows(f) for f in row)


def _of_height(frame: Frame, height: int, column: _Column) -> Frame:
    if frame.height is not None:
        return replace(frame, height=height)
    wide = max(1, round(height * frame.x.length / frame.y.length))
    return _of_width(frame, min(column.width, wide), column)


def _of_width(frame: Frame, width: int, column: _Column) -> Frame:
    left = column.width - width
    indent = left // 2
    margin = MARGIN + left - indent
    # A label is in the middle below the frame, and is cut off at either edge.
    reach = min(margin, column.left + indent)
    placed = replace(
        frame,
        x=_with_lines(frame.x, width + 2 * reach, _X_LINES),
        width=width,
        margin=margin,
        beside=column.left,
        indent=indent,
    )
    return replace(placed, legend_columns=legend_columns_that_fit(placed))


def _with_lines(axis: Axis, room: int, most: int) -> Axis:
    """Return an axis with its label in lines of a width; with none if it needs too many."""
    label = axis.label.replace("\n", " ")
    lines = wrapped(label, room, LABEL_SIZE)
    fits = len(lines) <= most and has_room_for_words(label, room, LABEL_SIZE)
    return replace(axis, label="\n".join(lines) if fits else "")


def _y_room(row: list[Frame]) -> int:
    """Return the height for the label of a left axis, which is in the middle beside its frame."""
    # The words begin above the label.
    (_, subtitle), *_ = words_of_row(row)
    above = max(_TOOLBAR - _LINE * len(subtitle), _SPACE)
    return row[0].frame_height + 2 * (min(above, _below(row)) - _FREE)


def _size(figure: Figure) -> float:
    """Return the shortest side of a frame, less where a place is empty."""
    least = min(min(frame.width, 2 * frame.frame_height) for frame in figure)
    places = figure.columns * math.ceil(len(figure) / figure.columns)
    return least * len(figure) / places


def _quality(figure: Figure) -> float:
    """Return the size of the frames, half of it where a word is broken."""
    is_whole = all(
        has_room_for_words(frame.title, frame.words_width, TITLE_SIZE, is_bold=True)
        for frame in figure
    )
    return _size(figure) if is_whole else _size(figure) / 2.0


def _least_height(figure: Figure) -> float:
    return min(frame.frame_height for frame in figure)


def _left(frame: Frame) -> int:
    ticks = max(_TICKS, round(_longest_tick(frame.y)) + 10)
    return ticks + (_LEFT + _LINE * frame.y.label.count("\n") if frame.y.label else 0)


def _right(frame: Frame) -> int:
    return _RIGHT + (_BAR if _has_bar(frame) else 0)


def _has_bar(frame: Frame) -> bool:
    looks = (look for glyphs in frame.glyphs for look in glyphs.looks.values())
    return any(isinstance(look, Ramp) and look.label is not None for look in looks)


def _rise(axis: Axis) -> int:
    """Return the height of turned labels, screen pixels."""
    return round(_longest_tick(axis) * math.sin(math.radians(axis.rotation)))


def _longest_tick(axis: Axis) -> float:
    if axis.ticks is None:
        return text_width(longest_label(axis), SMALL_SIZE)
    return max((text_width(label, SMALL_SIZE) for _, label in axis.ticks), default=0.0)
