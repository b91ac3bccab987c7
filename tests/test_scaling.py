"""The page on scaling and its plot agree with the file of measured times."""

from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from tests.benchmarks.chart import Panel, draw
from tests.benchmarks.scaling import (
    BEGIN,
    END,
    STAGES,
    Row,
    Scaling,
    block,
    plot,
    read_rows,
    with_block,
    write_all,
)

DOCUMENTS = Path(__file__).resolve().parent.parent / "assets" / "docs"
ROW = Row(132651, 250000, 6500, 96, 440, 3, 0.04, 0.1, 0.2, 0.06, 0.9, 0.3, 2.5, 1200.5)
ROWS = [ROW, ROW._replace(stars=5350, measurements=10000, unit=0.001, fit=0.15)]


def _circles(svg):
    root = ET.fromstring(svg)
    return [
        (float(circle.get("cx")), float(circle.get("cy")))
        for circle in root.iter("{http://www.w3.org/2000/svg}circle")
    ]


def test_page_shows_the_numbers_of_the_file():
    rows = read_rows(DOCUMENTS / "scaling.csv")
    text = (DOCUMENTS / "scaling.md").read_text("utf-8")
    machine = text.partition(BEGIN)[2].strip().partition("\n")[0]
    assert with_block(text, block(Scaling(rows, machine))) == text


def test_plot_is_drawn_from_the_file():
    rows = read_rows(DOCUMENTS / "scaling.csv")
    assert plot(rows) == (DOCUMENTS / "scaling.svg").read_text("utf-8")


def test_rows_are_read_back_from_the_file(tmp_path):
    write_all(Scaling(ROWS, "a machine"), tmp_path)
    assert read_rows(tmp_path / "scaling.csv") == ROWS


def test_page_keeps_its_text(tmp_path):
    page = tmp_path / "scaling.md"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n", "utf-8")
    write_all(Scaling(ROWS, "a machine"), tmp_path)
    text = page.read_text("utf-8")
    assert text.startswith(f"before\n{BEGIN}\na machine\n")
    assert text.endswith(f"{END}\nafter\n")
    assert "old" not in text


def test_page_without_marks_is_refused():
    with pytest.raises(ValueError, match="expected the marks"):
        with_block("no marks", "new")


def test_block_gives_seconds_units_and_microseconds():
    text = block(Scaling([ROW], "a machine"))
    assert "| 250,000 | 96 | 0.1 | 0.2 | 0.06 | 0.9 | 0.3 | 2.5 |" in text
    assert "| 250,000 | 96 | 2.5 | 5.0 | 1.5 | 22.5 | 7.5 | 62.5 |" in text
    assert "| 250,000 | 96 | 0.40 | 0.80 | 0.24 | 3.60 | 1.20 | 10.00 |" in text


def test_plot_has_a_point_for_every_time_and_a_legend():
    lines = len(STAGES) + 1
    # Both rows have 96 exposures; one has the paper's number of stars.
    assert len(_circles(plot(ROWS))) == lines * (1 + 3)


def test_axes_are_logarithmic():
    line = {"line": [(1.0, 0.01), (10.0, 0.1), (100.0, 1.0)]}
    (x_0, y_0), (x_1, y_1), (x_2, y_2) = _circles(draw([Panel("", "", line)], "s"))[-3:]
    assert x_1 - x_0 == pytest.approx(x_2 - x_1, abs=0.2)
    assert y_0 - y_1 == pytest.approx(y_1 - y_2, abs=0.2)
    assert x_0 < x_1
    assert y_0 > y_1


def test_axis_has_short_numbers():
    line = {"line": [(96.0, 1.0), (9_358.0, 1.0), (99_725.0, 10.0), (2_971_870.0, 10.0)]}
    root = ET.fromstring(draw([Panel("", "", line)], "s"))
    words = {text.text for text in root.iter("{http://www.w3.org/2000/svg}text")}
    assert {"96", "9.4k", "100k", "3M"} <= words
