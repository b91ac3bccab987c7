"""Small pieces of HTML in the project's style, readable in both themes."""

import re
from html import escape
from pathlib import Path

import pandas as pd
import panel as pn
import panel_material_ui as pmui

from plateviz.reports.summary_strip import STYLE
from plateviz.verdict.verdict import Verdict

_STYLES = [STYLE, (Path(__file__).parent / "style.css").read_text(encoding="utf-8")]


def markup_pane() -> pn.pane.HTML:
    """Return an empty pane with the style sheets of the project and of `style.css`."""
    return pn.pane.HTML("", stylesheets=_STYLES, sizing_mode="stretch_width", margin=0)


def paragraph(text: str, css_class: str, theme: str) -> str:
    """Return a paragraph of plain text, in which commands stand between backticks."""
    words = re.sub("`([^`]+)`", r"<code>\1</code>", escape(text))
    return themed(f"<p class='{css_class}'>{words}</p>", theme)


def themed(markup: str, theme: str) -> str:
    """Return markup in the colours of a theme."""
    return f"<div class='{theme}'>{markup}</div>"


def titled(role: str, name: str) -> str:
    """Return a title line for what is shown below it."""
    return f"<p class='solution'><span class='muted'>{role}:</span> <b>{escape(name)}</b></p>"


def judged(verdict: Verdict, *, is_open: bool = True) -> str:
    """Return the headline of a verdict with its reasons.

    Parameters
    ----------
    is_open : whether the reasons of a verdict that is not good are open at first
    """
    sentences = "".join(f"<li>{escape(text)}</li>" for text in verdict.reasons + verdict.notable)
    attribute = " open" if is_open and verdict.state != "good" else ""
    return (
        f"<details class='verdict {verdict.state}'{attribute}>"
        f"<summary>{escape(verdict.headline)}</summary><ul>{sentences}</ul></details>"
    )


def alert_words(text: str) -> str:
    """Return plain text for an alert, which takes its text for Markdown and keeps HTML in it.

    A name in it may be of a person, or of an address that somebody sent: a block of HTML has
    neither emphasis nor links.
    """
    return f"<p>{'<br>'.join(escape(text).splitlines())}</p>" if text else ""


def heading(text: str) -> pmui.Typography:
    """Return the heading of a part of the page or of its sidebar."""
    return pmui.Typography(text, variant="subtitle1", margin=(10, 10, 4, 10))


def numbers(table: pd.DataFrame, kind: str = "") -> str:
    """Return an HTML table of texts from `tables.headings.in_words`; empty cells have a dash.

    Parameters
    ----------
    kind : "changes" for a table of two things beside each other
    """
    head = "".join(f"<th>{escape(title)}</th>" for title in table.columns)
    rows = "".join(
        f"<tr>{''.join(f'<td>{escape(text) or chr(0x2013)}</td>' for text in row)}</tr>"
        for row in table.itertuples(index=False)
    )
    classes = f"numbers {kind}".strip()
    return f"<table class='{classes}'><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
