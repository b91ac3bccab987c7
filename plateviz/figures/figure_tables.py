"""The numbers of a figure as tables, to be kept in files."""

import re
import unicodedata
from collections.abc import Mapping

import numpy as np
from astropy.table import Column, Table

from plateviz.figures.figure import HANDLES, Figure, Frame, Glyphs

_ALONG_X = ("x", "x0", "x1", "xs", "left", "right")
_ALONG_Y = ("y", "y0", "y1", "y2", "ys", "bottom", "top")
_GREEK = re.compile("[α-ωΑ-Ω]")
_UNIT = re.compile("_(mas|uas|mpix)$")
# Units of a column with its name, and of an axis with its label: "x (mas, East to the left)".
_OF_NAME = re.compile("_(mas|uas|arcmin|deg|mpix|mm|um|nm)$")
_OF_LABEL = re.compile(r"\((mas|µas|arcmin|deg|mpix²?|pix|pixel|mm|µm|min|mag)[,)]")
# Names at their places, which other marks have as well.
_WITHOUT_NUMBERS = ("texts",)


def figure_tables(figure: Figure) -> dict[str, Table]:
    """Return a table for each kind of mark in the figure that has rows.

    Returns
    -------
    Name -> table. Coordinates are described by the label of their axis, with its unit. Of several
    frames, a name begins with the number of its frame, from 1. An image has a row per cell that
    has a value, at the cell's centre; outlines have a row per point, numbered by `path`. A unit at
    the end of a column's name, or in the label of its axis, is that of its values; but the ends of
    arrows have none, which are enlarged: the numbers are with their tails. Names of tables are in
    ASCII, since those of FITS have to be: `1σ expected` is `1sigma_expected`.
    """
    found: dict[str, Table] = {}
    for number, frame in enumerate(figure, 1):
        prefix = f"frame{number}_" if len(figure) > 1 else ""
        for glyphs in frame.glyphs:
            is_seen = glyphs.kind not in _WITHOUT_NUMBERS and glyphs.name != HANDLES
            if len(glyphs) and is_seen:
                name = prefix + _in_ascii(glyphs.name)
                found[name] = _table(frame, glyphs)
    return found


def _table(frame: Frame, glyphs: Glyphs) -> Table:
    columns = _cells(glyphs) if glyphs.kind == "image" else _rows(glyphs)
    # A label that is broken into lines for a narrow card is one line in a file.
    x, y = (" ".join(axis.label.split("\n")) for axis in (frame.x, frame.y))
    labels = dict.fromkeys(_ALONG_X, x) | dict.fromkeys(_ALONG_Y, y)
    described = {glyphs.at[at]: labels[at] for at in glyphs.at if at in labels}
    if glyphs.kind == "image":
        described = {"x": x, "y": y}
    title = " ".join(frame.title.split("\n"))
    table = Table(meta={"title": title} if title else {})
    for name, values in columns.items():
        plain = values.astype(str) if values.dtype == object else values
        in_file = _in_unit(name, glyphs.units.get(name))
        # A number in two units may be there twice in one that a person has chosen.
        if in_file not in table.colnames:
            label = described.get(name)
            has_unit = plain.dtype.kind in "fiu" and not glyphs.arrow_rows
            unit = _unit(in_file, label) if has_unit else None
            if label and glyphs.arrow_rows:
                label += "; an enlarged arrow as it is drawn"
            table[in_file] = Column(plain, unit=unit, description=label)
    return table


def _in_ascii(name: str) -> str:
    spelt = _GREEK.sub(lambda letter: unicodedata.name(letter[0]).split()[-1].lower(), name)
    return re.sub(r"\W+", "_", spelt, flags=re.ASCII)


def _in_unit(name: str, unit: str | None) -> str:
    """Return the name of a column with another unit at its end, if there was one."""
    return name if unit is None else _UNIT.sub(f"_{unit.replace('µ', 'u')}", name)


def _unit(name: str, label: str | None) -> str | None:
    """Return the unit of a column of numbers; None if it has none, or one for each row."""
    found = _OF_NAME.search(name) or _OF_LABEL.search(label or "")
    return None if found is None else found[1]


def _cells(glyphs: Glyphs) -> Mapping[str, np.ndarray]:
    values = np.asarray(glyphs.values("image")[0])
    rows, columns = values.shape
    x, y, width, height = (float(glyphs.values(at)[0]) for at in ("x", "y", "dw", "dh"))
    at_y, at_x = np.nonzero(np.isfinite(values))
    return {
        "x": x + (at_x + 0.5) * width / columns,
        "y": y + (at_y + 0.5) * height / rows,
        glyphs.at["image"]: values[at_y, at_x],
    }


def _rows(glyphs: Glyphs) -> Mapping[str, np.ndarray]:
    if glyphs.kind != "paths":
        return glyphs.columns
    lengths = [len(points) for points in glyphs.values("xs")]
    return {
        "path": np.repeat(np.arange(len(lengths)), lengths),
        "xs": np.concatenate(list(glyphs.values("xs"))),
        "ys": np.concatenate(list(glyphs.values("ys"))),
    }
