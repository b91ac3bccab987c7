"""Judging: whether the solutions on the screen of a session have their verdicts, without Panel."""

from typing import Any

import param

from plateviz.dashboard.session.solution import Solution
from plateviz.solving.judge import Judge


class Judging(param.Parameterized):
    """Follows the solution on the screen and the one that it is compared with.

    A solution is shown before it is judged; what needs its verdict waits.
    """

    is_pending = param.Boolean(
        default=False, doc="whether the solution on the screen is being judged"
    )
    is_any_pending = param.Boolean(default=False, doc="whether either solution is being judged")

    def __init__(self, session: Any, judge: Judge) -> None:  # noqa: ANN401 it imports this module
        """Follow `shown` and `other` of `session`."""
        super().__init__()
        self._session, self._judge = session, judge
        session.param.watch(self.look, ["shown", "other"])

    def look(self, *_: object) -> None:
        """Request verdicts that are not there; called again and again until they are."""
        shown, other = map(self._is_pending, (self._session.shown, self._session.other))
        self.param.update(is_pending=shown, is_any_pending=shown or other)

    def _is_pending(self, solution: Solution | None) -> bool:
        if solution is None:
            return False
        self._judge.request(solution.result)
        return not self._judge.has_judged(solution.result)
