"""Texts of files and names that pretend to be HTML: escaped in cards, reports and figures."""

from dataclasses import replace
from html.parser import HTMLParser

import pytest

from plateviz.notebook.card import card
from plateviz.notebook.solution import OpenSolution
from plateviz.reports.orbit import orbit_report
from plateviz.reports.page import page_of
from plateviz.tables.summary import SummaryItem
from plateviz.verdict.verdict import Verdict

HOSTILE = "a\"'></script></title><img src=x onerror='window.ran = 1'><b class=hostile>"


class Elements(HTMLParser):
    """Whether a page has an element of the hostile text, or an attribute with code of it."""

    def __init__(self, page):
        super().__init__()
        self.found, self.texts = [], []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        if ("src", "x") in attributes or ("class", "hostile") in attributes:
            self.found.append((tag, attributes))

    def handle_data(self, data):
        self.texts.append(data)


@pytest.fixture
def hostile_result(fit_result):
    """A result as an edited file would give it: hostile wherever there is free text."""
    summary = {**fit_result.summary, "reason": HOSTILE, "warnings": [HOSTILE]}
    verdict = {"state": "good", "headline": HOSTILE, "reasons": [HOSTILE], "notable": [HOSTILE]}
    return replace(
        fit_result,
        summary={**summary, "verdict": verdict},
        provenance={HOSTILE: "0123", "obs.fits": HOSTILE},
    )


def assert_harmless(page):
    elements = Elements(page)
    assert elements.found == []
    assert "window.ran" in "".join(elements.texts)


def test_the_test_finds_hostile_elements():
    assert Elements(f"<p>{HOSTILE}</p>").found
    assert Elements(f'<p title="{HOSTILE}"></p>').found


def test_card_shows_hostile_text():
    verdict = Verdict("bad", HOSTILE, [HOSTILE], [HOSTILE])
    assert_harmless(
        card(HOSTILE, HOSTILE, verdict, [SummaryItem(HOSTILE, HOSTILE, HOSTILE, "bad")])
    )


def test_solution_in_a_notebook_shows_hostile_text(hostile_result, instrument):
    named = replace(instrument, name=HOSTILE)
    solution = OpenSolution(hostile_result, named, HOSTILE, f"plateviz.open({HOSTILE!r})")
    assert_harmless(solution._repr_html_())


@pytest.mark.usefixtures("few_figures")
def test_report_shows_hostile_text(hostile_result, instrument):
    named = replace(instrument, name=HOSTILE)
    report = orbit_report(hostile_result, named, {HOSTILE: {HOSTILE: HOSTILE}})
    assert_harmless(page_of(replace(report, title=HOSTILE, subtitle=HOSTILE)))
