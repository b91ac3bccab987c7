"""A figure with glyphs of every kind."""

import numpy as np
import pandas as pd
import pytest

from plateviz.figures.figure import Axis, By, Ramp, framed, side_by_side
from plateviz.figures.glyphs import (
    band,
    ellipse,
    horizontal,
    image,
    line,
    paths,
    points,
    rectangles,
    segments,
    strip,
    texts,
    vertical,
)


@pytest.fixture
def table():
    return pd.DataFrame(
        {
            "x": [1.0, 2.0, 3.0],
            "y": [2.0, 1.0, np.nan],
            "id": ["7", "4611686018427387904", "9"],
            "kind": ["a", "b", "a"],
        }
    )


@pytest.fixture
def marks(table):
    def make(rows=3, name="sources"):
        return points(
            table.head(rows),
            "x",
            "y",
            name=name,
            color=By("kind", {"a": "mark", "b": "#e4602a"}),
            marker=By("kind", {"a": "circle", "b": "x"}),
            size=By("kind", {"a": 4.0, "b": 7.0}),
            hover=[("source", "@{id}")],
            label="@kind",
        )

    return make


@pytest.fixture
def framed_glyphs():
    """Return the function that frames glyphs."""

    def make(glyphs, title="Title", x=(0.0, 5.0), is_log=False, **options):
        axes = {"x": Axis("x (mm)", x, is_log=is_log), "y": Axis("y (mm)", (0.0, 4.0))}
        return framed(glyphs, title=title, width=200, **axes, **options)

    return make


@pytest.fixture
def every_kind(framed_glyphs, marks):
    cells = {"left": [0.0], "right": [1.0], "bottom": [0.0], "top": [1.0], "share": [0.4]}
    corners = np.array([(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)])
    first = framed_glyphs(
        [
            image(np.eye(3), (0.0, 3.0), (0.0, 3.0), name="image", ramp=Ramp("n", "count", (0, 1))),
            band([0.0, 5.0], [1.0, 1.0], [2.0, 2.0], name="band", label="expected"),
            strip(1.0, 2.0),
            horizontal(1.0),
            vertical([1.0, 2.0]),
            rectangles(cells, name="cells", color=Ramp("share", "share", (0, 1), label="share")),
            paths(
                [corners, corners + 1.0], name="outlines", color="line", dashes=["solid", "dotted"]
            ),
            segments([0.0], [0.0], [1.0], [2.0], name="bars", color="mark"),
            line([0.0, 5.0], [0.0, 4.0], name="law", color="text", label="law"),
            ellipse(np.diag([4.0, 1.0]), name="ellipse"),
            marks(),
            texts(
                [1.0],
                [1.0],
                ["name"],
                name="names",
                align=By("side", {"l": "left"}),
                keep={"side": ["l"]},
            ),
        ],
        subtitle="one line\nand another",
        legend_columns=3,
    )
    return side_by_side([first, framed_glyphs([marks()], title="Second")], columns=2, linked="x")
