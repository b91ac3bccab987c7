"""Small pieces of HTML in the project's style, readable in both themes."""

from html import escape
from pathlib import Path

import panel as pn

_STYLE = (Path(__file__).parent / "style.css").read_text(encoding="utf-8")


def markup_pane() -> pn.pane.HTML:
    """Return an empty pane that knows the classes of `style.css`."""
    return pn.pane.HTML("", stylesheets=[_STYLE], sizing_mode="stretch_width", margin=0)


def paragraph(text: str, css_class: str, theme: str) -> str:
    """Return a paragraph of plain text."""
    return f"<div class='{theme}'><p class='{css_class}'>{escape(text)}</p></div>"
