"""What Explore draws as text: read back as it was, and nonsense named."""

import math

import pytest

from plateviz.plots.explore.explored_rows import ExploredColumns
from plateviz.plots.explore.explored_text import parse_explored, text_of
from solver.errors import InputError


@pytest.mark.parametrize(
    "chosen",
    [
        ExploredColumns("x", "y"),
        ExploredColumns(
            "x", "y", colour="z", only="n", lowest=1.0 / 3.0, is_log_x=True, has_median=True
        ),
        ExploredColumns("x", "y", only="n", lowest=-1e-9, highest=61_822.125),
        ExploredColumns("x", "y", limits=((0.0, 1e-7 / 3.0), (-2.5, math.pi))),
    ],
)
def test_text_is_read_back(chosen):
    assert parse_explored(text_of("sources per orbit", chosen)) == ("sources per orbit", chosen)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "expected parts such as rows=measurements"),
        ("rows=sources&x=ra", "expected parts such as"),
        ("rows=sources&x=ra&y=dec&view=orbit", "found 'rows=sources&x=ra&y=dec&view=orbit'"),
        ("rows=sources&x=ra&y=dec&with=limits", "with: expected is_log_x"),
        ("rows=sources&x=ra&y=dec&only=n&between=1", "between: expected 2 numbers"),
        ("rows=sources&x=ra&y=dec&zoom=1~2~3~inf", "zoom: expected 4 numbers"),
    ],
)
def test_nonsense_is_named(text, words):
    with pytest.raises(InputError, match=words):
        parse_explored(text)
