"""Width of text before it is drawn, and text wrapped to a width."""

from collections.abc import Iterator

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
}
_WIDTHS = {character: width for width, all_of in _CLASSES.items() for character in all_of}
_WIDEST = 1.0
_BOLD = 1.13


def text_width(text: str, size: int, *, is_bold: bool = False) -> float:
    """Return how wide a line of text is at most, screen pixels.

    Parameters
    ----------
    size : of the font, screen pixels
    """
    letters = sum(_WIDTHS.get(character, _WIDEST) for character in text)
    return size * letters * (_BOLD if is_bold else 1.0)


def wrapped(text: str, width: float, size: int, *, is_bold: bool = False) -> list[str]:
    """Return the lines of text that is no wider than `width`; a longer word is broken.

    Parameters
    ----------
    width, size : of a line and of the font, screen pixels
    """

    def fits(line: str) -> bool:
        return text_width(line, size, is_bold=is_bold) <= width

    def pieces(word: str) -> Iterator[str]:
        while not fits(word):
            end = max(1, sum(fits(word[:end]) for end in range(1, len(word))))
            if end == len(word):
                break
            yield word[:end]
            word = word[end:]
        yield word

    lines = []
    for paragraph in text.split("\n"):
        line = ""
        for piece in (piece for word in paragraph.split() for piece in pieces(word)):
            longer = f"{line} {piece}".lstrip()
            if line and not fits(longer):
                lines.append(line)
                longer = piece
            line = longer
        if line:
            lines.append(line)
    return lines
