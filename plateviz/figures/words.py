"""Titles and subtitles of frames, wrapped to their widths."""

from collections.abc import Sequence
from typing import NamedTuple

from plateviz.figures.figure import Frame
from plateviz.figures.text_width import has_room_for_words, wrapped
from plateviz.figures.theme import SMALL_SIZE, TITLE_SIZE

# Bokeh drops empty lines, but not one with a space of no width.
_EMPTY = "\u200b"
# Room to the right of the subtitle for the button of the menu that has the tools, screen pixels.
MENU = 20


class Words(NamedTuple):
    """Lines of the title and the subtitle of a frame."""

    title: list[str]
    subtitle: list[str]


def words_of(frame: Frame) -> Words:
    """Return the words of a frame, wrapped to their room.

    The toolbar takes what the subtitle leaves of the width, and covers it if that is nothing.
    """
    width = frame.words_width
    title, beside = (
        wrapped(frame.title, room, TITLE_SIZE, is_bold=True)
        for room in (width, width - frame.corner)
    )
    # Beside what covers the corner, or below it where there is too little room beside it.
    is_whole = has_room_for_words(frame.title, width - frame.corner, TITLE_SIZE, is_bold=True)
    title = beside if is_whole and len(beside) <= len(title) + 1 else [_EMPTY, *title]
    return Words(title, wrapped(frame.subtitle, width - MENU, SMALL_SIZE))


def words_of_row(row: Sequence[Frame]) -> list[Words]:
    """Return the words of the frames of a row, with as many lines each."""
    found = [words_of(frame) for frame in row]
    titles, subtitles = (
        _filled([getattr(words, name) for words in found]) for name in Words._fields
    )
    return [Words(*lines) for lines in zip(titles, subtitles, strict=True)]


def _filled(texts: list[list[str]]) -> list[list[str]]:
    """Return texts with as many lines each, all of which begin on one line."""
    if any(lines[:1] == [_EMPTY] for lines in texts):
        texts = [lines if lines[:1] == [_EMPTY] else [_EMPTY, *lines] for lines in texts]
    most = max(map(len, texts))
    return [[*lines, *[_EMPTY] * (most - len(lines))] for lines in texts]
