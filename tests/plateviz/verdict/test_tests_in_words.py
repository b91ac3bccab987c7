from types import SimpleNamespace

import pytest

from plateviz.verdict.tests_in_words import discoveries_in_words
from plateviz.verdict.tests_in_words import tests_in_words as in_words
from solver.results.diagnosis.test import Test


@pytest.mark.parametrize(
    ("place", "words"), [(0, "1st"), (1, "2nd"), (2, "3rd"), (3, "4th"), (10, "11th"), (20, "21st")]
)
def test_detector_of_a_test_is_told_by_its_place_not_as_an_id(place, words):
    """Its id may be another number: those of the default instrument begin with 0."""
    test = Test("turn of a detector", "turn", (place,), 9.0, 3.0, 2.4, -3.5, 2.2)
    (found,) = in_words(SimpleNamespace(tests=(test,)))
    assert found.name == f"turn of a detector, {words} detector of the instrument"


@pytest.mark.parametrize(("count", "words"), [(1, "1 of 3 tests finds"), (2, "2 of 3 tests find")])
def test_number_of_discoveries_agrees_with_its_verb(count, words):
    tests = [Test("noise", "noise", (), 9.0, 3.0, 2.4, -3.5, 2.2)] * 3
    assert discoveries_in_words(tests, tests[:count]).startswith(f"{words} what chance")
