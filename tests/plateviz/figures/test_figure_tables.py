"""The numbers of a figure as tables."""

from dataclasses import replace

import numpy as np
import pandas as pd

from plateviz.figures.figure import Figure, side_by_side
from plateviz.figures.figure_tables import figure_tables
from plateviz.figures.glyphs import line, points
from plateviz.plots.elements.arrows import Field, arrows


def test_every_kind_of_mark_but_names_has_a_table(every_kind):
    tables = figure_tables(Figure(every_kind.frames[:1]))
    kinds = {glyphs.name: glyphs.kind for glyphs in every_kind[0].glyphs if len(glyphs)}
    assert len(tables) == sum(kind != "texts" for kind in kinds.values())
    points = tables["sources"]
    assert points["x"].tolist() == [1.0, 2.0, 3.0]
    assert points["id"].tolist() == ["7", "4611686018427387904", "9"]
    assert points["x"].description == "x (mm)"


def test_columns_of_numbers_have_the_units_of_their_names_and_axes(framed_glyphs):
    table = {"x": [1.0], "y": [2.0], "sigma_mas": [3.0], "n": [4], "name_mas": ["a"]}
    hover = [("σ", "@{sigma_mas} mas"), ("n", "@{n}"), ("name", "@{name_mas}")]
    frame = framed_glyphs([points(table, "x", "y", name="sources", color="mark", hover=hover)])[0]
    labels = replace(frame.x, label="Δα cos δ (µas, East to the left)"), replace(frame.y, label="σ")
    saved = figure_tables(Figure((replace(frame, x=labels[0], y=labels[1]),)))["sources"]
    units = {name: saved[name].unit for name in saved.colnames}
    assert units == {"x": "uas", "y": None, "sigma_mas": "mas", "n": None, "name_mas": None}


def test_ends_of_arrows_have_no_unit_since_they_are_enlarged(framed_glyphs):
    vectors = pd.DataFrame({"x": [1.0], "y": [2.0], "u": [1e-3], "v": [0.0], "u_um": [1.0]})
    area, hover = Field((0.0, 5.0), (0.0, 4.0)), [("u", "@{u_um} µm")]
    drawn = arrows(vectors, scale=1000.0, field=area, colour="mark", hover=hover)
    frame = framed_glyphs(drawn)[0]
    tables = figure_tables(Figure((replace(frame, x=replace(frame.x, label="x (mm)")),)))
    strokes, tails = tables["arrows"], tables["tails"]
    assert (strokes["x1"] - strokes["x0"])[0] == 1.0
    assert {strokes[name].unit for name in strokes.colnames} == {None}
    assert strokes["x1"].description == "x (mm); an enlarged arrow as it is drawn"
    assert (tails["x"].unit, tails["u_um"].unit) == ("mm", "um")


def test_image_has_a_row_per_cell_at_its_centre(every_kind):
    cells = figure_tables(every_kind)["frame1_image"]
    assert len(cells) == 9
    is_one = np.asarray(cells[cells.colnames[-1]]) == 1.0
    assert cells["x"][is_one].tolist() == [0.5, 1.5, 2.5]
    assert cells["y"][is_one].tolist() == [0.5, 1.5, 2.5]


def test_outlines_have_a_row_per_point(every_kind):
    outlines = figure_tables(every_kind)["frame1_outlines"]
    assert outlines["path"].tolist() == [0, 0, 0, 1, 1, 1]
    assert outlines["xs"].tolist() == [0.0, 1.0, 2.0, 1.0, 2.0, 3.0]


def test_frames_are_numbered_where_there_are_several(framed_glyphs, marks):
    figure = side_by_side([framed_glyphs([marks()]), framed_glyphs([marks(rows=1)])], columns=1)
    tables = figure_tables(figure)
    assert {name: len(table) for name, table in tables.items()} == {
        "frame1_sources": 3,
        "frame2_sources": 1,
    }


def test_names_and_labels_are_such_as_every_format_can_have(framed_glyphs, marks):
    law = line([0.0, 1.0], [0.0, 1.0], name="1σ expected", color="text")
    frame = framed_glyphs([marks(), law])[0]
    x = replace(frame.x, label="fitted minus\nprior (mas)")
    frame = replace(frame, title="Two\nlines", x=x)
    tables = figure_tables(Figure((frame,)))
    assert set(tables) == {"sources", "1sigma_expected"}
    assert tables["sources"].meta == {"title": "Two lines"}
    assert tables["sources"]["x"].description == "fitted minus prior (mas)"
