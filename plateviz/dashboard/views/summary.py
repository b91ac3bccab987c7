"""SummaryView: whether to trust a solution, in words and as numbers in one strip."""

import panel as pn

from plateviz.dashboard.session import Session, Solution, Stage
from plateviz.dashboard.views.markup import judged, markup_pane, paragraph, titled
from plateviz.reports.summary_strip import strip
from plateviz.tables import summary_strip
from plateviz.tables.verdict import orbit_verdict
from solver.data.result import FitResult


class SummaryView(pn.viewable.Viewer):
    """The verdict on the solution on the screen, its strip, and that of the one compared with."""

    def __init__(self, session: Session, **params: object) -> None:
        """Follow `session`."""
        super().__init__(**params)
        self._session = session
        self._strip = markup_pane()
        self._judged: tuple[FitResult, str] | None = None
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
        rows = [
            self._verdict(shown.result),
            _row(shown, "(B) Solution" if other else "Solution"),
        ]
        if other is not None:
            rows.append(_row(other, "(A) Compared with solution"))
        stale = " stale" if session.stage is Stage.STALE else ""
        self._strip.object = f"<div class='{session.theme}{stale}'>{''.join(rows)}</div>"

    def _verdict(self, result: FitResult) -> str:
        if self._judged is None or self._judged[0] is not result:
            self._judged = (result, judged(orbit_verdict(result)))
        return self._judged[1]


def _row(solution: Solution, role: str) -> str:
    of_orbit = "" if solution.orbit is None else f" of orbit {solution.orbit}"
    return titled(role + of_orbit, solution.label) + strip(summary_strip(solution.result))
