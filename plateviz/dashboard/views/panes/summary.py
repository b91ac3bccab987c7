"""HeadView: the verdict on the solution on the screen; StripView: the numbers that it rests on."""

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.solution import Solution
from plateviz.dashboard.session.stage import Stage
from plateviz.dashboard.views.cards.state_text import missing_text, outdated_text
from plateviz.dashboard.views.elements.markup import judged, markup_pane, paragraph, titled
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.reports.summary_strip import strip
from plateviz.tables import summary_strip
from plateviz.verdict.verdict import orbit_verdict
from solver.data.result import FitResult

# As high as the headline of a verdict, so that nothing moves when this comes.
_BEING_JUDGED = "<p class='verdict judging'>This solution is being judged.</p>"


class HeadView(pn.viewable.Viewer):
    """The verdict on the solution on the screen, and which solutions are shown.

    In the Verdict workspace the reasons are open, unless the verdict is good or has causes, which
    stand below it.
    """

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow `navigation` and its session."""
        super().__init__(**params)
        self._navigation, self._session = navigation, navigation.session
        self._head, self._outdated = markup_pane(), markup_pane()
        self._column = pmui.Column(
            self._head, self._outdated, sizing_mode="stretch_width", margin=0
        )
        self._session.param.watch(self._write, ["shown", "other", "stage", "theme"])
        self._session.judging.param.watch(self._write, "is_pending")
        self._session.journal.param.watch(self._write, "made")
        self._session.units.param.watch(self._write, "unit")
        told = ["shown", "stage", "message", "is_brief", "theme"]
        self._session.param.watch(self._write_outdated, told)
        navigation.param.watch(self._write, "orbit_workspace")
        self._write()
        self._write_outdated()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the verdict, and why it is not that of the requested solution."""
        return self._column

    def _write(self, *_: object) -> None:
        session = self._session
        shown, other = session.shown, session.other
        if shown is None:
            self._head.object = paragraph(missing_text(session), "empty", session.theme)
            return
        is_open = self._navigation.orbit_workspace is OrbitWorkspace.VERDICT
        names = [self._name(shown, "(B) Solution" if other else "Solution")]
        if other is not None:
            names.append(self._name(other, "(A) Compared with solution"))
        stale = " stale" if session.stage is Stage.STALE else ""
        verdict = session.units.text(self._verdict(shown.result, is_open))
        self._head.object = (
            f"<div class='head {session.theme}{stale}'>{verdict}{''.join(names)}</div>"
        )

    def _write_outdated(self, *_: object) -> None:
        # Apart from the verdict, whose reasons would close with each step of a fit.
        words = outdated_text(self._session)
        markup = paragraph(words, "outdated", self._session.theme) if words else ""
        self._outdated.param.update(object=markup, visible=bool(words))

    def _name(self, solution: Solution, role: str) -> str:
        of_orbit = "" if solution.orbit is None else f" of orbit {solution.orbit}"
        return titled(role + of_orbit, self._session.journal.label(solution))

    def _verdict(self, result: FitResult, is_open: bool) -> str:
        if not self._session.store.judge.has_judged(result):
            return _BEING_JUDGED
        verdict = orbit_verdict(result)
        return judged(verdict, is_open=is_open and not verdict.causes)


class StripView(pn.viewable.Viewer):
    """The summary strip of the solution on the screen, and where the one compared with differs."""

    def __init__(self, session: Session, **params: object) -> None:
        """Follow `session`."""
        super().__init__(**params)
        self._session = session
        self._strip = markup_pane()
        session.param.watch(self._write, ["shown", "other", "stage", "theme"])
        session.units.param.watch(self._write, "unit")
        self._write()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the strip."""
        return self._strip

    def _write(self, *_: object) -> None:
        session = self._session
        if session.shown is None:
            self._strip.object = ""
            return
        others = [] if session.other is None else summary_strip(session.other.result)
        numbers = strip(summary_strip(session.shown.result), others)
        stale = " stale" if session.stage is Stage.STALE else ""
        markup = session.units.text(numbers)
        self._strip.object = f"<div class='{session.theme}{stale}'>{markup}</div>"
