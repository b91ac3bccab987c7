"""Figure: frames side by side, each with axes, words and glyph tables; plain values throughout.

A figure says what is to be seen, without a theme and without a library that draws: its numbers can
be tested as they are, and one that is drawn can follow another (`plateviz.figures.bokeh_figure`).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

Limits = tuple[float, float]
Tooltips = Sequence[tuple[str, str]]
"""Label and format of each line of a hover; "@{name}" is the value of a column."""
Ticks = Sequence[tuple[float, str]]
Kind = Literal[
    "points",
    "line",
    "segments",
    "rectangles",
    "texts",
    "paths",
    "band",
    "image",
    "horizontal",
    "vertical",
    "strip",
]
Link = Literal["", "x", "xy"]
FRAME_WIDTH, MARGIN = 460, 14
# To the left of words, screen pixels.
_EDGE = 10
MESSAGE = "message"
"""Name of the text of a figure that has nothing to show."""
HANDLES = "handles"
"""Name of wide paths that are not seen, by which the paths below them are tapped."""


@dataclass(frozen=True)
class By:
    """A look that depends on the text in a column.

    Attributes
    ----------
    column : name of the column
    looks : text -> colour, marker or number
    """

    column: str
    looks: Mapping[str, str | float]


@dataclass(frozen=True)
class Ramp:
    """A colour that depends on the number in a column.

    Attributes
    ----------
    column : name of the column
    palette : of the theme: "count", "share", or "difference" from a value in the middle; or the
        colours themselves, each for one whole number
    limits : numbers with the first and the last colour
    is_log : whether colours are in logarithmic steps
    label : of the colour bar; None for no bar
    """

    column: str
    palette: Literal["count", "share", "difference"] | tuple[str, ...]
    limits: Limits
    is_log: bool = False
    label: str | None = None


Look = str | float | By | Ramp | None


@dataclass(frozen=True, eq=False)
class Glyphs:
    """A table with a glyph per row; a line, band or path has all rows.

    Attributes
    ----------
    kind : of the glyphs
    name : unique in its frame, and the same for other data
    columns : name -> values, all of one length
    at : the glyph's coordinates, such as "x" -> name of the column
    looks : named as the properties of Bokeh's glyphs; a colour is one of the theme ("text",
        "muted", "line", "mark", "grid", "background") or a value such as "#4291d2"
    hover : what is shown beside a glyph under the cursor
    label : of the legend; "@name" for the texts of a column, empty for none
    reach : of the frame's limits between which an image is shown; None for all
    units : column -> unit of its values, in place of the one at the end of its name
    arrow_rows : rows that draw one arrow; 0 where the glyphs are no arrows
    """

    kind: Kind
    name: str
    columns: Mapping[str, np.ndarray]
    at: Mapping[str, str]
    looks: Mapping[str, Look]
    hover: Tooltips = ()
    label: str = ""
    reach: Limits | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    arrow_rows: int = 0

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(next(iter(self.columns.values()), ()))

    @cached_property
    def labels(self) -> frozenset[str]:
        """The texts in the legend."""
        if self.label.startswith("@"):
            return frozenset(map(str, self.columns[self.label[1:]]))
        return frozenset([self.label] if self.label and len(self) else [])

    def values(self, coordinate: str) -> np.ndarray:
        """Return the values of a coordinate of the glyphs, such as "x"."""
        return self.columns[self.at[coordinate]]


@dataclass(frozen=True)
class Axis:
    """One axis of a frame.

    Attributes
    ----------
    label : with its unit
    limits : at both ends; the first may be the larger
    is_log : whether the axis is logarithmic
    ticks : values and labels; None for automatic ones
    rotation : of the labels, deg
    is_grouped : whether digits of large numbers stand in groups of three; those of years do not
    """

    label: str
    limits: Limits
    is_log: bool = False
    ticks: Ticks | None = None
    rotation: float = 0.0
    is_grouped: bool = True

    @property
    def length(self) -> float:
        """Difference of the limits, positive."""
        return abs(self.limits[1] - self.limits[0])


@dataclass(frozen=True, eq=False)
class Frame:
    """One pair of axes with its glyphs and words.

    Attributes
    ----------
    glyphs : drawn in order, with unique names
    title, subtitle : above the frame; wrapped to the width of it and of the room beside it
    x, y : the axes
    width : screen pixels
    height : screen pixels; None for equal scales of both axes
    legend_columns : columns of the legend, which is below the frame so that it covers no data;
        0 for no legend
    margin : room to the right of the frame, screen pixels
    beside : room to the left of the frame for the axis, screen pixels
    indent : room to the left of that, screen pixels
    corner : width of what covers the right end of the title's room, screen pixels
    """

    glyphs: tuple[Glyphs, ...]
    title: str
    subtitle: str
    x: Axis
    y: Axis
    width: int = FRAME_WIDTH
    height: int | None = None
    legend_columns: int = 0
    margin: int = MARGIN
    beside: int = 0
    indent: int = 0
    corner: int = 0

    def __getitem__(self, name: str) -> Glyphs:
        """Return the glyphs of that name; KeyError if there are none."""
        found = {glyphs.name: glyphs for glyphs in self.glyphs}
        return found[name]

    @property
    def names(self) -> list[str]:
        """Names of the glyphs."""
        return [glyphs.name for glyphs in self.glyphs]

    @property
    def outdent(self) -> int:
        """How far to the left of the frame its words and its legend begin, screen pixels."""
        return max(0, self.indent + self.beside - _EDGE)

    @property
    def words_width(self) -> int:
        """Room for its words and its legend, screen pixels."""
        return self.outdent + self.width + self.margin

    @property
    def frame_height(self) -> int:
        """Height of the frame, screen pixels."""
        if self.height is not None:
            return self.height
        return max(1, round(self.width * self.y.length / self.x.length))


@dataclass(frozen=True, eq=False)
class Figure:
    """Frames in rows.

    Attributes
    ----------
    frames : from left to right, then from top to bottom
    columns : frames in a row
    linked : axes that all frames share: "", "x" or "xy"
    """

    frames: tuple[Frame, ...]
    columns: int = 1
    linked: Link = ""

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.frames)

    def __iter__(self) -> Iterator[Frame]:
        """Iterate over the frames."""
        return iter(self.frames)

    def __getitem__(self, number: int) -> Frame:
        """Return a frame."""
        return self.frames[number]

    @property
    def message(self) -> str | None:
        """Why there is nothing to show; None if there is."""
        (first, *_) = self.frames
        return str(first[MESSAGE].columns["text"][0]) if MESSAGE in first.names else None


def framed(
    glyphs: Sequence[Glyphs],
    *,
    title: str,
    subtitle: str = "",
    x: Axis,
    y: Axis,
    width: int,
    height: int | None = None,
    legend_columns: int = 0,
) -> Figure:
    """Return a figure of one frame; parameters as the attributes of `Frame`."""
    frame = Frame(tuple(glyphs), title, subtitle, x, y, width, height, legend_columns)
    return Figure((frame,))


def side_by_side(figures: Sequence[Figure], *, columns: int, linked: Link = "") -> Figure:
    """Return the frames of all figures in rows of `columns`; `linked` as in `Figure`."""
    return Figure(tuple(frame for figure in figures for frame in figure), columns, linked)


def message(
    title: str, text: str, *, width: int = FRAME_WIDTH, xlabel: str = "", ylabel: str = ""
) -> Figure:
    """Return a figure without data, with a text that gives the reason."""
    columns = {"x": np.array([0.5]), "y": np.array([0.5]), "text": np.array([text], dtype=object)}
    words = Glyphs(
        "texts",
        MESSAGE,
        columns,
        {"x": "x", "y": "y", "text": "text"},
        {
            "text_color": "muted",
            "text_font_size": "13px",
            "text_align": "center",
            "text_baseline": "middle",
        },
    )
    x, y = (Axis(label, (0.0, 1.0), ticks=()) for label in (xlabel, ylabel))
    return framed([words], title=title, x=x, y=y, width=width, height=round(0.6 * width))
