"""CardTools: the buttons in the corner of a card that explain it and open it large."""

from collections.abc import Callable, Sequence
from pathlib import Path

import panel as pn
import param

from plateviz.dashboard.views.cards.figure_text import FigureText
from plateviz.figures.figure_summary import TextTable

_HERE = Path(__file__).parent


class CardTools(pn.custom.JSComponent):
    """Two buttons: one explains what the card shows, the other fills the window with the card.

    The explanation has the equation, the place in the documents, what is drawn now in words, and
    its numbers as tables when they are asked for. The words name the card for a screen reader.
    Escape closes either.
    """

    title = param.String(doc="what the card shows, in a few words")
    theme = param.Selector(default="light", objects=["light", "dark"])
    help = param.String(doc="what it shows and how it looks for a good solution")
    equation = param.String(doc="what is drawn, as text")
    # Not "document", which a Bokeh model has already.
    place = param.String(doc="where the documents explain it: file and section")
    is_stale = param.Boolean(doc="whether what is drawn is of the last solution")
    summary = param.String(doc="what is drawn now, in words and numbers")

    _esm = (_HERE / "card_tools.js").read_text(encoding="utf-8")
    _stylesheets = [(_HERE / "card_tools.css").read_text(encoding="utf-8")]

    def __init__(
        self, figure: FigureText, tables: Callable[[], Sequence[TextTable]], **params: object
    ) -> None:
        """Stand in the upper right corner of the nearest positioned ancestor.

        Parameters
        ----------
        tables : returns the numbers that are drawn
        """
        super().__init__(
            title=figure.title,
            help=figure.caption,
            equation=figure.equation,
            place=figure.document,
            margin=0,
            **params,
        )
        self._tables = tables

    def _handle_msg(self, data: object) -> None:
        if data == "tables":
            self._send_msg({"tables": [one._asdict() for one in self._tables()]})
