"""Titles and subtitles of frames, wrapped to their widths."""

import textwrap
from collections.abc import Sequence
from typing import NamedTuple

from plateviz.figures.figure import Frame

# Screen pixels per character of the labels' and of the title's font.
PER_CHARACTER = 5.3
_PER_CHARACTER_OF_TITLE = 7.2


class Words(NamedTuple):
    """Lines of the title and the subtitle of a frame."""

    title: list[str]
    subtitle: list[str]


def words_of(frame: Frame) -> Words:
    """Return the words of a frame, wrapped to its width and its margin."""
    width = frame.width + frame.margin
    return Words(
        _wrapped(frame.title, width / _PER_CHARACTER_OF_TITLE),
        _wrapped(frame.subtitle, width / PER_CHARACTER),
    )


def words_of_row(row: Sequence[Frame]) -> list[Words]:
    """Return the words of the frames of a row, with as many lines each."""
    found = [words_of(frame) for frame in row]
    titles, subtitles = (
        _filled([getattr(words, name) for words in found]) for name in Words._fields
    )
    return [Words(*lines) for lines in zip(titles, subtitles, strict=True)]


def _wrapped(text: str, characters: float) -> list[str]:
    at_most = max(1, int(characters))
    lines = text.split("\n")
    return [part for line in lines for part in textwrap.wrap(line, at_most, break_long_words=False)]


def _filled(texts: list[list[str]]) -> list[list[str]]:
    most = max(map(len, texts))
    # Bokeh drops empty lines, but not one with a space of no width.
    return [[*lines, *["\u200b"] * (most - len(lines))] for lines in texts]
