"""Cards: the verdict and the numbers of an object as HTML that needs no script."""

from collections.abc import Iterable
from html import escape
from importlib.resources import files

from plateviz.reports.summary_strip import STYLE, strip
from plateviz.tables import SummaryItem
from plateviz.verdict.verdict import Verdict

CARD_STYLE = STYLE + (files("plateviz.notebook") / "card.css").read_text(encoding="utf-8")
"""The colours of both themes, and the classes of cards and captions."""


def card(title: str, subtitle: str, verdict: Verdict | None, items: Iterable[SummaryItem]) -> str:
    """Return the title, the verdict and the numbers of an object as HTML.

    Parameters
    ----------
    verdict : None if there is none
    items : numbers, in the order of the tiles
    """
    return (
        f"<style>{CARD_STYLE}</style><div class='plateviz'>"
        f"<p class='title'><b>{escape(title)}</b> <span>{escape(subtitle)}</span></p>"
        f"{_verdict(verdict)}{strip(items)}</div>"
    )


def summary_line(title: str, subtitle: str, verdict: Verdict | None) -> str:
    """Return the title and the verdict as one line of text."""
    headline = "" if verdict is None else f": {verdict.headline}"
    return f"{title} ({subtitle}){headline}"


def _verdict(verdict: Verdict | None) -> str:
    if verdict is None:
        return ""
    sentences = [*(cause.sentence() for cause in verdict.causes), *verdict.notable]
    notable = "".join(f"<li>{escape(text)}</li>" for text in sentences)
    notable = f"<ul>{notable}</ul>" if notable else ""
    return f"<p class='verdict {verdict.state}'>{escape(verdict.headline)}</p>{notable}"
