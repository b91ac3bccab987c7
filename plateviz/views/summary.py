"""SummaryView: the numbers that decide whether to trust a solution, in one strip."""

from html import escape

import panel as pn

from plateviz.session import Session, Solution, Stage
from plateviz.tables import SummaryItem, summary_strip
from plateviz.views.markup import markup_pane, paragraph


class SummaryView(pn.viewable.Viewer):
    """The strip of the solution on the screen, and of the one it is compared with."""

    def __init__(self, session: Session, **params: object) -> None:
        """Follow `session`."""
        super().__init__(**params)
        self._session = session
        self._strip = markup_pane()
        session.param.watch(self._write, ["shown", "other", "stage", "theme"])
        self._write()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the strip."""
        return self._strip

    def _write(self, *_: object) -> None:
        session = self._session
        shown, other = session.shown, session.other
        if shown is None:
            words = session.message if session.stage is Stage.FAILED else "No solution yet."
            self._strip.object = paragraph(words, "empty", session.theme)
            return
        rows = [_row(shown, "Solution on the screen (B)" if other else "Solution")]
        if other is not None:
            rows.append(_row(other, "Compared with (A)"))
        stale = " stale" if session.stage is Stage.STALE else ""
        self._strip.object = f"<div class='{session.theme}{stale}'>{''.join(rows)}</div>"


def _row(solution: Solution, role: str) -> str:
    cells = "".join(_cell(item) for item in summary_strip(solution.result))
    label = f"<span class='muted'>{role}:</span> <b>{escape(solution.label)}</b>"
    return f"<p class='solution'>{label}</p><div class='strip'>{cells}</div>"


def _cell(item: SummaryItem) -> str:
    value, bracket, beside = item.value.partition(" (")
    return (
        f"<div class='cell {item.state}' title='{escape(item.hint, quote=True)}'>"
        f"<span class='name'>{escape(item.label)}</span>"
        f"<span class='value'>{escape(value)}"
        f"<span class='beside'>{escape(bracket + beside)}</span></span></div>"
    )
