"""The summary strip as HTML: tiles, the line of counts, and what a solution is compared with."""

import re

import pytest

from plateviz.reports.summary_strip import strip
from plateviz.tables.summary import SummaryItem

CHI2 = SummaryItem("χ²", "1.003", "Expected 1.", "good")
DEVIATION = SummaryItem("α", "0.3 (expected 0.2)", "A 'hint'.", "warn")
COUNT = SummaryItem("Sources", "12", "Solved for.", "neutral", is_count=True)


def test_numbers_are_tiles_and_counts_a_line():
    html = strip([CHI2, COUNT, DEVIATION])
    tiles, line = html.split("<div class='counts'>")
    assert tiles.count("class='cell ") == 2
    assert "<span class='name'>Sources</span><span class='values'><span class='value'>12" in line
    assert "A &#x27;hint&#x27;." in tiles
    assert "counts" not in strip([CHI2])


def test_values_that_differ_stand_beside_each_other():
    others = [CHI2._replace(value="1.5 (<b>)", state="bad"), DEVIATION]
    html = strip([CHI2, DEVIATION, COUNT], others)
    assert html.count("(A)") == 1
    assert "<span class='other bad'>(A) 1.5</span></span></div>" in html
    # Below the values the others leave its line free; a count needs none.
    assert html.count("<span class='other'>&nbsp;</span>") == 1
    assert strip([COUNT], [COUNT]) == strip([COUNT])
    assert "<b>" not in html


@pytest.mark.parametrize(
    ("n_tiles", "expected"),
    [
        (3, [[3], [3], [3]]),
        (7, [[7], [4, 3], [4, 3]]),
        (8, [[8], [4, 4], [4, 4]]),
        (9, [[9], [5, 4], [3, 3, 3]]),
        (10, [[10], [5, 5], [4, 4, 2]]),
    ],
)
def test_no_row_has_a_single_tile(n_tiles, expected):
    html = strip([CHI2._replace(label=str(n)) for n in range(n_tiles)])
    numbers = [int(found) for found in re.findall(r"--\w+:(\d+)", html)]
    rows = [[min(n, n_tiles - k) for k in range(0, n_tiles, n)] for n in numbers]
    assert rows == expected
