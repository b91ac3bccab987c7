"""A figure in words and as tables of texts."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import Axis, framed, message, side_by_side
from plateviz.figures.figure_summary import MOST_ROWS, figure_summary, text_tables
from plateviz.figures.glyphs import horizontal, line, points
from plateviz.plots.elements.arrows import Field, arrows, key


def figure_of(n, title="Errors", name="sources"):
    table = {"x": np.arange(n, dtype=float), "y": np.full(n, 1 / 3), "id": ["<b>7</b>"] * n}
    marks = points(table, "x", "y", name=name, color="mark", hover=[("source", "@{id}")])
    curve = line([0.0, 1.0], [np.nan, 2.0], name="law", color="line", label="the law")
    return framed(
        [horizontal(0.0, name="zero"), curve, marks],
        title=title,
        subtitle="mean 0.12 mas\nrms 0.3 mas",
        x=Axis("time (yr)", (0.0, 9.0)),
        y=Axis("offset (mas)", (0.0, 2.0)),
        width=200,
    )


def test_summary_has_a_sentence_with_the_numbers_of_each_frame():
    figure = side_by_side([figure_of(1), figure_of(1200, "More")], columns=2)
    assert figure_summary(figure) == (
        "Errors. mean 0.12 mas; rms 0.3 mas. offset (mas) against time (yr): 1 point (sources). "
        "More. mean 0.12 mas; rms 0.3 mas. offset (mas) against time (yr): 1,200 points (sources)."
    )


def test_summary_counts_arrows_and_not_their_strokes():
    vectors = pd.DataFrame(dict.fromkeys("xyuv", np.arange(184.0)))
    area = Field((-9.0, 9.0), (-9.0, 9.0))
    drawn = arrows(vectors, scale=1.0, field=area, colour="mark", hover=())
    axes = Axis("x (mm)", area.x), Axis("y (mm)", area.y)
    length = key(1.0, "1 mm", scale=1.0, field=area)
    figure = framed([*drawn, *length], title="Residuals", x=axes[0], y=axes[1], width=200)
    assert figure_summary(figure).endswith("184 arrows, 184 points (tails), 1 arrow (key).")


def test_summary_says_why_nothing_is_drawn():
    assert figure_summary(message("Errors", "No sources")) == "Nothing is drawn: No sources."


def test_tables_have_the_first_rows_as_texts():
    tables = {table.name: table for table in text_tables(figure_of(MOST_ROWS + 1))}
    assert set(tables) == {"sources", "law", "zero"}
    sources = tables["sources"]
    assert (sources.title, sources.size) == ("Errors", MOST_ROWS + 1)
    assert sources.columns == ["x: time (yr)", "y: offset (mas)", "id"]
    assert len(sources.rows) == MOST_ROWS
    assert sources.rows[1] == ["1", "0.333333", "<b>7</b>"]
    assert tables["law"].rows == [["0", "–"], ["1", "2"]]
