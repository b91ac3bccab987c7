"""A figure in words and as text tables, for whoever does not see it."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from plateviz.figures.figure import Figure, Frame, Glyphs
from plateviz.figures.figure_tables import figure_tables
from solver.data.plural import plural

# Rows of a text table; files have all.
MOST_ROWS = 200
_MARKS = {"points": "point", "segments": "stroke", "rectangles": "bar"}


class TextTable(NamedTuple):
    """A table of texts.

    Attributes
    ----------
    name : of the marks
    title : of their frame
    size : number of rows of the whole table
    columns : names, with the label of the axis where one belongs to it
    rows : the first `MOST_ROWS`
    """

    name: str
    title: str
    size: int
    columns: list[str]
    rows: list[list[str]]


def figure_summary(figure: Figure) -> str:
    """Return what a figure shows in words and numbers: a sentence for each frame."""
    if figure.message is not None:
        return f"Nothing is drawn: {figure.message}."
    return " ".join(map(_sentence, figure))


def text_tables(figure: Figure) -> list[TextTable]:
    """Return the numbers of a figure as tables of texts."""
    found = []
    for name, table in figure_tables(figure).items():
        columns = [
            f"{one}: {table[one].description}" if table[one].description else one
            for one in table.colnames
        ]
        shown = table[:MOST_ROWS]
        rows = [[_text(value) for value in row] for row in shown.iterrows()]
        found.append(
            TextTable(
                name.replace("_", " "), table.meta.get("title", ""), len(table), columns, rows
            )
        )
    return found


def _sentence(frame: Frame) -> str:
    parts = [part for part in (frame.title, frame.subtitle.replace("\n", "; ")) if part]
    drawn = ", ".join(_counted(frame))
    axes = f"{frame.y.label} against {frame.x.label}"
    return f"{'. '.join(parts)}. {axes}{f': {drawn}' if drawn else ''}."


def _counted(frame: Frame) -> Iterator[str]:
    for glyphs in frame.glyphs:
        if glyphs.kind in _MARKS and len(glyphs):
            n, mark = len(glyphs), _MARKS[glyphs.kind]
            if glyphs.arrow_rows:
                n, mark = n // glyphs.arrow_rows, "arrow"
            marks, name = plural(n, mark), _name(glyphs)
            yield f"{n:,} {marks}" if name == f"{mark}s" else f"{n:,} {marks} ({name})"


def _name(glyphs: Glyphs) -> str:
    return glyphs.label if glyphs.label and not glyphs.label.startswith("@") else glyphs.name


def _text(value: object) -> str:
    if isinstance(value, float | np.floating):
        return f"{value:.6g}" if np.isfinite(value) else "–"
    return str(value)
