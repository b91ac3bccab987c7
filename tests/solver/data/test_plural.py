"""The number 1 takes the singular, and 0 and all others the plural."""

import pytest

from solver.data.plural import plural


@pytest.mark.parametrize(
    ("number", "words"), [(0, "0 sources"), (1, "1 source"), (1.5, "1.5 sources"), (2, "2 sources")]
)
def test_one_takes_the_singular(number, words):
    assert f"{number} {plural(number, 'source')}" == words
