"""Ticker: draws what is due on a page, and follows what goes on elsewhere."""

from contextvars import Context
from functools import partial

import panel as pn
from bokeh.document import Document
from bokeh.server.callbacks import TimeoutCallback
from param.parameterized import Event
from tornado.ioloop import IOLoop

from plateviz.dashboard.at_rest import AtRest
from plateviz.dashboard.navigation.figures_ahead import FiguresAhead
from plateviz.dashboard.navigation.lost_run import look_for_run
from plateviz.dashboard.navigation.navigation import WORKSPACES, Navigation
from plateviz.dashboard.serving.model_search import one_search
from plateviz.dashboard.session.expected_what_ifs import ExpectedWhatIfs
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.shown_address import SHOWN
from plateviz.dashboard.views.pages.pages import Pages
from plateviz.solving.job import Job
from solver.data.subset import KINDS

# Milliseconds between two looks at what a running job says.
_PROGRESS_MILLISECONDS = 250
# Milliseconds between two questions for what the solver process makes, and how many come as soon;
# later ones come like looks at a job. Other threads tell when they are done.
_PENDING_MILLISECONDS, _MOST_SOON = 50, 20
# Milliseconds between two looks at a run that is not complete.
_LOOK = 2000
# Seconds between two looks whether the run is there at all, and whether others have begun.
_LOOK_FOR_RUN_SECONDS = 10.0
# The solver fits what what-ifs start from once a page has been at rest for so long. Before, the
# browser draws and a person may step on to the next orbit, for which a fit would take the cores.
_REST_SECONDS = 3.0
# Seconds that the controls of a refit wait for a fit; one that takes longer can be cancelled.
_CONTROLS_SECONDS = 3.0


class Ticker:
    """Ticks for a page from when it has loaded on: to draw before would delay it."""

    def __init__(self) -> None:
        """Begin without a page."""
        self._of_page: PageTicker | None = None

    def follow(self, navigation: Navigation, pages: Pages) -> None:
        """Begin once the page has loaded."""

        def begin() -> None:
            self._of_page = PageTicker(navigation, pages)

        pn.state.onload(begin)

    def wake(self, *_: object) -> None:
        """Tick until nothing is left to do; nothing happens before the page has loaded."""
        if self._of_page is not None:
            self._of_page.wake()


class PageTicker:
    """Follows job and run, draws figures that are due and completes the page, while there is need.

    A job belongs to the server and may outlive the page: it calls when it is over, and what it
    says in between is looked at now and then.
    """

    def __init__(self, navigation: Navigation, pages: Pages) -> None:
        """Begin to follow a page that has loaded."""
        session = navigation.session
        self._navigation, self._pages = navigation, pages
        # None for a page in a notebook without a server.
        self._document: Document | None = pn.state.curdoc
        self._loop = IOLoop.current()
        self._progress = pn.state.add_periodic_callback(
            self._tick, period=_PROGRESS_MILLISECONDS, start=False
        )
        self._looks = pn.state.add_periodic_callback(self._look, period=_LOOK, start=False)
        self._watched: Job | None = None
        self._is_to_tick = False
        self._later: TimeoutCallback | None = None
        # Questions for what is being made, since something has last changed.
        self._n_asked = 0
        # A timer of this page's context would keep the page until its time has come.
        later = None if self._document is None else partial(Context().run, self._loop.call_later)
        self._expected = ExpectedWhatIfs(session)
        self._rest = AtRest(self._expected.ask_for_fit, _REST_SECONDS, later)
        self._watch_page()
        self.wake()
        self._follow_run()
        self._looks_for_run: AtRest | None = None
        self._ahead: FiguresAhead | None = None
        if later is not None:
            self._ahead = FiguresAhead(navigation, self._expected, later)
            self._looks_for_run = AtRest(self._look_soon, _LOOK_FOR_RUN_SECONDS, later)
            self._looks_for_run.begin()

    def _watch_page(self) -> None:
        navigation, session = self._navigation, self._navigation.session
        session.param.watch(self.wake, ["stage", "shown", "other", "theme"])
        session.shown_part.param.watch(self.wake, [*SHOWN])
        session.selection.param.watch(self.wake, [*KINDS])
        session.units.param.watch(self.wake, "unit")
        session.choices.param.watch(self._expect_typed, "typed")
        names = ["view", *WORKSPACES.values(), "run_name", "run_progress", "found"]
        navigation.param.watch(self.wake, names)
        navigation.param.watch(self._follow_run, "run_name")

    def wake(self, *_: object) -> None:
        """Tick until nothing is left to do."""
        self._n_asked = 0
        if self._is_to_tick:
            return
        if self._document is None:
            # Nothing calls back into a page without a document.
            self._start_looking()
            return
        if not self._has_ended:
            self._is_to_tick = True
            self._document.add_next_tick_callback(self._tick)

    def _start_looking(self) -> None:
        if not self._progress.running:
            self._progress.start()

    def _expect_typed(self, event: Event) -> None:
        if event.new:
            self._expected.ask()

    def _call(self) -> None:
        """Tick soon; called from any thread."""
        self._loop.add_callback(self._tick_now)

    def _tick_now(self) -> None:
        """Tick, without a wait for what is being made."""
        later, self._later = self._later, None
        if later is not None and not self._has_ended and self._document is not None:
            self._document.remove_timeout_callback(later)
            self._is_to_tick = False
        self.wake()

    def _follow_run(self, *_: object) -> None:
        """Look again and again what a run has that is not complete."""
        if self._navigation.growth and not self._looks.running:
            self._looks.start()

    def _look(self) -> None:
        if self._pages.is_due:
            # A table that the browser is still making takes no other rows.
            return
        if not self._navigation.look_again():
            self._looks.stop()

    @property
    def _has_ended(self) -> bool:
        """Whether the page has been closed; a timer or a job may come before it is forgotten."""
        return self._document is None or self._document.session_context is None

    def _look_soon(self) -> None:
        if self._document is not None and not self._has_ended:
            self._document.add_next_tick_callback(self._look_for_run)

    def _look_for_run(self) -> None:
        look_for_run(self._navigation)
        if self._looks_for_run is not None:
            self._looks_for_run.begin()

    def _tick(self) -> None:
        self._is_to_tick, self._later = False, None
        session = self._navigation.session
        # What follows from a new solution is sent as one message.
        with pn.io.hold(), one_search(self._document):
            session.poll()
            session.judging.look()
            self._pages.draw_due()
        job = session.job
        self._watch(job)
        if self._pages.is_pending or session.judging.is_any_pending:
            self._tick_later(session)
        elif self._pages.is_due or self._pages.complete(_is_brief(job)):
            self.wake()
        elif job is None:
            self._come_to_rest()

    def _watch(self, job: Job | None) -> None:
        """Follow a job that is new."""
        if job is not None and job is not self._watched:
            self._watched = job
            job.watch(self._call)
            self._start_looking()

    def _tick_later(self, session: Session) -> None:
        """Tick again in a while: another thread is at work, and would wait for a page that asks."""
        if self._document is None:
            self.wake()
            return
        self._is_to_tick = True
        is_soon = self._n_asked < _MOST_SOON
        self._n_asked += 1
        wait = _PENDING_MILLISECONDS if is_soon else _PROGRESS_MILLISECONDS
        self._later = self._document.add_timeout_callback(self._tick, wait)
        session.store.background.listen(self._call)

    def _come_to_rest(self) -> None:
        """Stop looking, and prepare what a person is likely to do next."""
        if self._progress.running:
            self._progress.stop()
        self._navigation.expect_orbit()
        self._expected.ask()
        self._rest.begin()
        if self._ahead is not None:
            self._ahead.begin()


def _is_brief(job: Job | None) -> bool:
    return job is not None and job.seconds < _CONTROLS_SECONDS
