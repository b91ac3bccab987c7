"""DrawnArea: what becomes of the selection where a person draws a box or a lasso around nothing."""

from plateviz.dashboard.session.session import Session
from solver.data.subset import Subset

_NO_POINTS = "There are no points in that area; "


class DrawnArea:
    """An area that a person draws in a figure; without points in it, nothing changes.

    The browser clears the selection of such a figure first, and tells of the area afterwards.
    """

    def __init__(self, session: Session) -> None:
        """Keep the selection of `session`, and say why in its `remark`."""
        self._session = session
        self._before: Subset | None = None

    def begin(self) -> None:
        """Remember the selection, when a person begins to draw."""
        self._before = self._session.selection.selected

    def end(self, has_points: bool) -> None:
        """Select again what was selected before, if there are no points in the area."""
        session, before = self._session, self._before
        self._before = None
        if has_points:
            session.remark = ""
            return
        if before is not None:
            session.selection.select(before)
        is_any = bool(session.selection.selected)
        session.remark = _NO_POINTS + (
            "what was selected stays selected" if is_any else "nothing is selected"
        )
