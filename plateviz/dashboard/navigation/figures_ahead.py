"""FiguresAhead: the figures of a what-if without the selection, made before it is asked for."""

from contextlib import suppress

from plateviz.dashboard.at_rest import AtRest, Later
from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.session.expected_what_ifs import ExpectedWhatIfs
from plateviz.dashboard.session.orbit_figures import chosen_next, figure_of, figures_of
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.solution import Request
from plateviz.plots.workspace import OrbitWorkspace

# Seconds between two looks whether the solver has made the solution, and how often one looks.
_LOOK_SECONDS, _MOST_LOOKS = 0.5, 6


class FiguresAhead:
    """Makes the figures of a workspace for the what-if without the selection, on another thread.

    They take longer than all else that a click on *Leave out* waits for. Of the other what-ifs that
    are expected they are not made: only a selection tells what a person is about to do.
    """

    def __init__(self, navigation: Navigation, expected: ExpectedWhatIfs, later: Later) -> None:
        """Begin without any."""
        self._navigation, self._expected = navigation, expected
        self._rest = AtRest(self._look, _LOOK_SECONDS, later)
        self._looks = 0
        self._wanted: Request | None = None

    def begin(self) -> None:
        """Make them once the solver has made the solution; called when the page comes to rest."""
        settings = self._expected.without_selection()
        self._looks, self._wanted = _MOST_LOOKS, None
        if settings is not None:
            orbit = self._navigation.session.shown_part.orbit
            self._wanted = Request(orbit, settings, is_what_if=True)
            self._rest.begin()

    def _look(self) -> None:
        """Make the figures if the solution is there; look again if it is to come."""
        session, wanted = self._navigation.session, self._wanted
        if wanted is None or wanted.orbit != session.shown_part.orbit or session.job is not None:
            return
        if session.store.has_result(*wanted):
            workspace = self._navigation.orbit_workspace
            session.store.background.submit(_make, session, wanted, workspace)
        elif self._looks > 0:
            self._looks -= 1
            self._rest.begin()


def _make(session: Session, wanted: Request, workspace: OrbitWorkspace) -> None:
    result = session.store.result(*wanted)
    if result is None:
        return
    chosen = chosen_next(session, result)
    for one in figures_of(session, workspace):
        if not (one.needs_verdict or one.needs_eigenmodes):
            # What is wrong is said where the figure is drawn.
            with suppress(Exception):
                figure_of(one, chosen)
