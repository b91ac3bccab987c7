"""SummaryView: the numbers that show whether to trust a solution, in one strip."""

import panel as pn

from plateviz.dashboard.session import Session, Solution, Stage
from plateviz.dashboard.views.markup import markup_pane, paragraph, titled
from plateviz.reports.summary_strip import strip
from plateviz.tables import summary_strip


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
            text = session.message if session.stage is Stage.FAILED else "No solution yet."
            self._strip.object = paragraph(text, "empty", session.theme)
            return
        rows = [_row(shown, "(B) Solution" if other else "Solution")]
        if other is not None:
            rows.append(_row(other, "(A) Compared with solution"))
        stale = " stale" if session.stage is Stage.STALE else ""
        self._strip.object = f"<div class='{session.theme}{stale}'>{''.join(rows)}</div>"


def _row(solution: Solution, role: str) -> str:
    of_orbit = "" if solution.orbit is None else f" of orbit {solution.orbit}"
    return titled(role + of_orbit, solution.label) + strip(summary_strip(solution.result))
