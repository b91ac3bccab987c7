"""Columns of texts are sent packed to pages that unpack them, and as they are to others."""

import json
from dataclasses import replace

import numpy as np
import pytest
from bokeh.core.serialization import Serializer
from bokeh.models import ColumnDataSource

from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.figure import Frame
from plateviz.figures.packed_texts import TYPE, PackedTexts

MANY = 1000
CLASSES = np.array(["reference", "non-reference"] * (MANY // 2), dtype=object)
IDS = np.array([str(4040000018209076524 + row) for row in range(MANY)], dtype=object)


def unpacked(written):
    """Return the texts as the scripts of a page do."""
    words = written["texts"].split("\n")
    if "numbers" not in written:
        return words
    numbers = written["numbers"]
    rows = np.frombuffer(numbers["array"]["data"].data, dtype=numbers["dtype"])
    return [words[row] for row in rows]


@pytest.mark.parametrize("texts", [CLASSES, IDS], ids=["classes", "ids"])
def test_packed_texts_are_the_same(texts):
    written = Serializer().encode(PackedTexts.of(texts))
    assert written["type"] == TYPE
    assert unpacked(written) == texts.tolist()


def test_texts_that_repeat_are_written_once():
    written = Serializer().encode(PackedTexts.of(CLASSES))
    assert written["texts"] == "reference\nnon-reference"
    assert written["numbers"]["dtype"] == "uint8"


@pytest.mark.parametrize(
    "column",
    [
        np.arange(MANY),
        CLASSES[:3],
        np.array(["two\nlines"] * MANY, dtype=object),
        np.array([None] * MANY, dtype=object),
        np.empty((MANY, 2), dtype=object),
    ],
    ids=["numbers", "few", "lines", "nothing", "two dimensions"],
)
def test_other_columns_stay_as_they_are(column):
    assert PackedTexts.of(column) is column


def test_only_a_figure_for_a_page_that_unpacks_them_has_packed_texts(every_kind):
    figure = replace(every_kind, frames=tuple(map(with_ids, every_kind)))
    for is_packed in (False, True):
        model = BokehFigure(figure, "light", is_packed=is_packed).model
        columns = [source.data["id"] for source in model.select({"type": ColumnDataSource})]
        assert columns
        assert all(isinstance(one, PackedTexts) is is_packed for one in columns)
        assert (TYPE in json.dumps(Serializer().encode(model), default=str)) is is_packed


def with_ids(frame: Frame) -> Frame:
    """Return a frame with one table of points, of many rows with ids."""
    points = next(one for one in frame.glyphs if one.kind == "points")
    columns = {name: np.resize(one, MANY) for name, one in points.columns.items()}
    return replace(frame, glyphs=(replace(points, columns=columns | {"id": IDS}),))
