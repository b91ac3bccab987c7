"""Files of what differs: numbers that programs read, and texts as they are."""

import pandas as pd
import pytest

from plateviz.dashboard.saving.changes_file import changes_file
from plateviz.verdict.changes import COLUMNS, merit


@pytest.mark.parametrize(
    ("a", "b", "decimals"),
    [(1_662_469.6, 1_593_050.9, 1), (1.003, 1.2615, 4), (271_950, 271_950, 0), (0.0, -0.5, 1)],
)
def test_numbers_are_numbers_for_programs(a, b, decimals):
    changes = pd.DataFrame([merit("What", a, b, decimals)], columns=list(COLUMNS))
    (row,) = changes_file(changes)["changes"]
    found = [float(row[name]) for name in ("a", "b", "change")]
    assert found == pytest.approx([a, b, b - a])


@pytest.mark.parametrize(
    "text", ["", "order 5", "without detectors 1, 2", "1,2", "−", "2028-02-01"]
)
def test_texts_stay(text):
    changes = pd.DataFrame([("Left out", text, "none", "")], columns=list(COLUMNS))
    (row,) = changes_file(changes)["changes"]
    assert tuple(row) == ("Left out", text, "none", "")
