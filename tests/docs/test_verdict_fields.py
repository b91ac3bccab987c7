"""The page on diagnostics names every field that the verdict has in JSON."""

import re

import pytest

from plateviz.verdict.causes import Cause
from plateviz.verdict.tests_in_words import TestInWords
from plateviz.verdict.verdict import Verdict
from tests.docs.pages import DOCS, section_of

SECTION = section_of(DOCS / "diagnostics.md", "The verdict")
INTRODUCTION = re.search(r"^`plateviz fit --json` has.+?\n\n", SECTION, re.M | re.S)[0]


def rows_of(title):
    """Return the names in the first column of the table with this title."""
    table = re.search(rf"^\| {title} \|.+?\n\n", SECTION, re.MULTILINE | re.DOTALL)[0]
    cells = [row.split("|")[1] for row in table.strip().splitlines()]
    return [name for cell in cells for name in re.findall(r"`(\w+)`", cell)]


def test_fields_of_a_verdict_are_named():
    assert set(Verdict._fields) <= set(re.findall(r"`(\w+)`", INTRODUCTION))


@pytest.mark.parametrize(
    ("title", "kind"), [("field of a cause", Cause), ("field of a test", TestInWords)]
)
def test_tables_have_the_fields_in_their_order(title, kind):
    assert rows_of(title) == list(kind._fields)
