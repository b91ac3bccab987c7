"""Pieces of HTML of the pages."""

from html import escape, unescape

import panel_material_ui as pmui
import pytest
from bokeh.document import Document

from plateviz.dashboard.views.elements.markup import alert_words, judged, paragraph
from plateviz.verdict.verdict import Verdict

VERDICT = Verdict("warn", "The headline.", ["A reason."], ["What stands out."])


@pytest.mark.parametrize(("state", "is_open"), [("good", False), ("warn", True), ("bad", True)])
def test_reasons_of_a_verdict_are_open_unless_it_is_good(state, is_open):
    html = judged(VERDICT._replace(state=state))
    assert html.startswith(f"<details class='verdict {state}'{' open' if is_open else ''}>")
    assert "<summary>The headline.</summary>" in html
    assert "<li>A reason.</li><li>What stands out.</li>" in html


def test_reasons_can_be_closed_at_first():
    assert judged(VERDICT, is_open=False).startswith("<details class='verdict warn'><summary>")


def test_commands_of_a_paragraph_stand_out():
    html = paragraph("Type `plateviz <b>`, then wait.", "empty", "light")
    assert "Type <code>plateviz &lt;b&gt;</code>, then wait." in html


def test_verdict_is_text():
    html = judged(Verdict("bad", "<b>", ["<img src=x onerror=alert(1)>"], []))
    assert "<b>" not in html
    assert "<img" not in html


def test_name_in_an_alert_is_neither_emphasis_nor_a_link():
    text = "found '__import__', '[log in](http://evil.example)', 'https://evil.example/', '<b>'"
    alert = pmui.Alert(object=alert_words(f"{text}\n\n# second *line*"))
    shown = alert.get_root(Document()).data.object
    once = unescape(shown).strip()
    assert once == f"<p>{escape(text)}<br><br># second *line*</p>"
    assert alert_words("") == ""
