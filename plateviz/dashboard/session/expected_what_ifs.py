"""ExpectedWhatIfs: what-ifs that a person may ask for next, which the solver makes while idle."""

from plateviz.dashboard.session.fit_choices import FitChoices
from plateviz.dashboard.session.selection_actions import SelectionActions
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.solution import Solution, what_if_settings
from solver.data.settings import ENGINES, FitSettings
from solver.errors import InputError


class ExpectedWhatIfs:
    """The what-ifs of the solution on the screen of a session that a person reaches in one step.

    They are those with a prior width that is being typed, without the selection, and with the next
    lower and the next higher order of the distortion. Nobody waits for them; a what-if that is
    asked for is there at once if it is one.
    """

    def __init__(self, session: Session) -> None:
        """Ask the store of `session`."""
        self._session, self._actions = session, SelectionActions(session)
        self._fitted: Solution | None = None
        self._asked: list[FitSettings] = []

    def ask(self) -> None:
        """Let the solver make them if it has fitted the orbit; called when all is drawn."""
        fitted = self._session.fitted
        if fitted is not None and (fitted is self._fitted or not _is_read(fitted)):
            self._ask(fitted)

    def ask_for_fit(self) -> None:
        """Let the solver make them, and fit the orbit for it if only another process has.

        Called when the page has been at rest for a while: a person may look at one orbit after the
        other.
        """
        if (fitted := self._session.fitted) is not None:
            self._ask(fitted)

    def settings(self) -> list[FitSettings]:
        """Return their settings, the likeliest first."""
        session = self._session
        fitted = session.fitted
        try:
            now = session.choices.settings()
        except InputError:
            return []
        if fitted is None or now.engine != ENGINES[0]:
            return []
        found = self._typed()
        if session.selection.selected and not self._actions.is_left_out:
            found.append(self._actions.without_selected(now))
        lowest = FitChoices.param["order"].bounds[0]
        for order in (now.order - 1, now.order + 1):
            if lowest <= order <= fitted.settings.order:
                found.append(now.with_(order=order))
        known = [now, *(solution.settings for solution in session.solutions)]
        return [what_if_settings(one, fitted.settings) for one in found if one not in known]

    def _typed(self) -> list[FitSettings]:
        try:
            return [self._session.choices.typed_settings()] if self._session.choices.typed else []
        except InputError:
            # A number is not complete.
            return []

    def _ask(self, fitted: Solution) -> None:
        session = self._session
        if session.job is not None or not session.choices.what_if_at_once:
            return
        expected = self.settings()
        if fitted is self._fitted and expected == self._asked:
            return
        self._fitted, self._asked = fitted, expected
        session.store.prepare(
            fitted.orbit,
            fitted.settings,
            expected,
            may_fit=_is_read(fitted),
            # Nothing is drawn while a person types.
            is_urgent=bool(session.choices.typed),
        )


def _is_read(solution: Solution) -> bool:
    """Return whether a solution was read from a disk, and not made by this server's solver."""
    return bool(solution.run or solution.kept)
