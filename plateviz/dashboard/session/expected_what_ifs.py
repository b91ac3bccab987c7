"""ExpectedWhatIfs: what-ifs that a person may ask for next, which the solver makes while idle."""

from contextlib import suppress

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
        now, fitted = self._now(), self._session.fitted
        if now is None or fitted is None:
            return []
        lowest = FitChoices.param["order"].bounds[0]
        orders = [now.order - 1, now.order + 1]
        of_orders = [
            now.with_(order=order) for order in orders if lowest <= order <= fitted.settings.order
        ]
        return self._unknown([*self._typed(), *self._without_selected(now), *of_orders])

    def without_selection(self) -> FitSettings | None:
        """Return the settings of that without the selection; None if it is none of them."""
        now = self._now()
        found = [] if now is None else self._unknown(self._without_selected(now))
        return found[0] if found else None

    def _now(self) -> FitSettings | None:
        """Return the settings of the controls; None if no what-if starts from them."""
        with suppress(InputError):
            now = self._session.choices.settings()
            if self._session.fitted is not None and now.engine == ENGINES[0]:
                return now
        return None

    def _without_selected(self, now: FitSettings) -> list[FitSettings]:
        if not self._session.selection.selected or self._actions.is_left_out:
            return []
        return [self._actions.without_selected(now)]

    def _unknown(self, found: list[FitSettings]) -> list[FitSettings]:
        """Return what-ifs with some settings, but for those that are there."""
        session = self._session
        fitted = session.fitted
        if fitted is None:
            return []
        known = [self._now(), *(solution.settings for solution in session.solutions)]
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
