"""Width of text before it is drawn, and text wrapped to a width."""

import re
from collections.abc import Iterator
from functools import lru_cache

# Width of characters over the size of the font in DejaVu Sans, the widest of the common fonts that
# `theme.FONT` stands for: it is shown where there is neither Helvetica nor Arial.
_CLASSES = {
    0.32: "'ijlIJ ,.·|",
    0.41: "/:;\\f-()[]t!²³r",
    0.53: '"*_`–°sz?',
    0.60: "cLξFkχvxyλPTY",
    0.64: "aoδθeESbdghnpquση$0123456789{}µ√",
    0.70: "KαφAVΔBRXZC",
    0.79: "UHNDG&OQ",
    0.84: "−",
}
_WIDTHS = {character: width for width, all_of in _CLASSES.items() for character in all_of}
_WIDEST = 1.0
_BOLD = 1.13
# Between a hyphen and what follows it.
_HYPHEN = re.compile(r"(?<=.-)")
# Texts whose widths are remembered: those of a figure are needed at each of its changes.
_REMEMBERED = 4096
# Of the width, to which lines are narrowed so that the last one has more than a word.
_SHARES = (0.92, 0.84, 0.76, 0.68)


def text_width(text: str, size: int, *, is_bold: bool = False) -> float:
    """Return how wide a line of text is at most, screen pixels.

    Parameters
    ----------
    size : of the font, screen pixels
    """
    return size * _letters(text) * (_BOLD if is_bold else 1.0)


def wrapped(text: str, width: float, size: int, *, is_bold: bool = False) -> list[str]:
    """Return the lines of text that is no wider than `width`; a longer word is broken.

    A paragraph ends with a single word only where there is no other way.

    Parameters
    ----------
    width, size : of a line and of the font, screen pixels
    """
    return [
        line
        for paragraph in text.split("\n")
        for line in _balanced(paragraph, width, size, is_bold)
    ]


def cut_to(text: str, width: float, size: int) -> str:
    """Return text that is no wider than `width`: whole, or its first words and an ellipsis."""
    if text_width(text, size) <= width:
        return text
    words = text.split(" ")
    for count in range(len(words) - 1, 0, -1):
        shorter = " ".join(words[:count]).rstrip(",") + " ..."
        if text_width(shorter, size) <= width:
            return shorter
    return text


def has_room_for_words(text: str, width: float, size: int, *, is_bold: bool = False) -> bool:
    """Return whether no word has to be broken, except after a hyphen; parameters as `wrapped`."""
    return size * _widest_part(text) * (_BOLD if is_bold else 1.0) <= width


@lru_cache(_REMEMBERED)
def _letters(text: str) -> float:
    """Return how wide a line of text is at most, in sizes of the font."""
    return sum(_WIDTHS.get(character, _WIDEST) for character in text)


@lru_cache(_REMEMBERED)
def _widest_part(text: str) -> float:
    """Return the width of the widest word, or part of one with hyphens, in sizes of the font."""
    parts = (part for word in text.split() for part in _HYPHEN.split(word))
    return max(map(_letters, parts), default=0.0)


@lru_cache(_REMEMBERED)
def _balanced(paragraph: str, width: float, size: int, is_bold: bool) -> list[str]:
    lines = _lines(paragraph, width, size, is_bold)
    if len(lines) > 1 and " " not in lines[-1]:
        for less in (share * width for share in _SHARES):
            if not has_room_for_words(paragraph, less, size, is_bold=is_bold):
                break
            narrower = _lines(paragraph, less, size, is_bold)
            if len(narrower) == len(lines) and " " in narrower[-1]:
                return narrower
    return lines


def _lines(paragraph: str, width: float, size: int, is_bold: bool) -> list[str]:
    """Return lines, each with as many words as it has room for."""
    space = text_width(" ", size, is_bold=is_bold)
    lines, line, left = [], "", width
    for piece, needs in _pieces(paragraph, width, size, is_bold):
        if line and space + needs <= left:
            line, left = f"{line} {piece}", left - space - needs
            continue
        if line:
            lines.append(line)
        line, left = piece, width - needs
    return [*lines, line] if line else lines


def _pieces(text: str, width: float, size: int, is_bold: bool) -> Iterator[tuple[str, float]]:
    """Iterate over words, those that are too wide in parts, each with its width."""
    for word in text.split():
        rest, needs = word, text_width(word, size, is_bold=is_bold)
        while needs > width and len(rest) > 1:
            ends = range(1, len(rest))
            end = max(1, sum(text_width(rest[:n], size, is_bold=is_bold) <= width for n in ends))
            end = rest.rfind("-", 0, end) + 1 or end
            yield rest[:end], text_width(rest[:end], size, is_bold=is_bold)
            rest = rest[end:]
            needs = text_width(rest, size, is_bold=is_bold)
        yield rest, needs
