"""The dashboard: one page per browser session, over a shared solution store."""

from contextvars import Context
from functools import partial
from html import escape

import panel as pn
import panel_material_ui as pmui
import param
from bokeh.document import Document
from bokeh.themes import Theme
from panel.io.resources import get_dist_path
from param.parameterized import Watcher
from tornado.ioloop import IOLoop

from plateviz.dashboard.at_rest import AtRest
from plateviz.dashboard.lost_run import look_for_run
from plateviz.dashboard.model_search import one_search
from plateviz.dashboard.navigation import WORKSPACES, Navigation
from plateviz.dashboard.page_request import WINDOW
from plateviz.dashboard.rooms import Rooms, Window, window_from
from plateviz.dashboard.selected import KINDS
from plateviz.dashboard.session import Session
from plateviz.dashboard.views.accessible_names import AccessibleNames
from plateviz.dashboard.views.address_bar import AddressBar
from plateviz.dashboard.views.browser_session import BrowserSession
from plateviz.dashboard.views.figure import Part
from plateviz.dashboard.views.figure_painting import FigurePainting
from plateviz.dashboard.views.keyboard import Keyboard
from plateviz.dashboard.views.page_style import PAGE_STYLE
from plateviz.dashboard.views.pages import Pages
from plateviz.dashboard.views.report_button import report_button
from plateviz.dashboard.views.selection_bar import SelectionBar
from plateviz.dashboard.views.system_theme import SystemTheme
from plateviz.dashboard.views.view_file import ViewFile
from plateviz.solving.job import Job
from plateviz.solving.solution_store import SolutionStore

# Milliseconds between two looks at what a running job says.
_PROGRESS_MILLISECONDS = 250
# Milliseconds between two questions for what another thread makes.
_PENDING_MILLISECONDS = 50
# Milliseconds between two looks at a run that is not complete.
_LOOK = 2000
# Seconds between two looks whether the run is there at all, and whether others have begun.
_LOOK_FOR_RUN_SECONDS = 10.0
# The solver prepares what-ifs once a page has been at rest for so long. Before, the browser draws
# and a person may step on to the next orbit, for which a fit would take the cores.
_REST_SECONDS = 3.0
# Seconds that the controls of a refit wait for a fit; one that takes longer can be cancelled.
_CONTROLS_SECONDS = 3.0
_SIDEBAR_WIDTH = 264
_STYLED = ("Plot", "Title", "Axis", "Grid", "Legend", "ColorBar")


def build_app(store: SolutionStore, rooms: Rooms | None = None) -> pmui.Page:
    """Return the page of one session over `store`.

    Parameters
    ----------
    rooms : of the cards of earlier pages, with which the first figures are drawn at once
    """
    window = _window()
    if window is not None and window.is_dark:
        # The first component that the browser makes decides the theme of all.
        pn.config.theme = "dark"  # type: ignore[assignment]
    navigation, ticker, pages = _pages(store, window, rooms)
    session = navigation.session
    bar, system = SelectionBar(navigation), SystemTheme()
    header = [
        bar,
        ViewFile(navigation),
        report_button(navigation, "bar"),
        Keyboard(navigation),
        system,
        AddressBar(navigation),
        BrowserSession(session.journal),
        AccessibleNames(),
        FigurePainting(),
    ]
    page = empty_page(
        store,
        header=header,
        sidebar=[pages.sidebar],
        main=[pages, bar.windows],
    )
    # The page's busy indicator changes with every event, and each change makes Panel walk all
    # models of all figures, which takes half a second. The refit panel shows progress instead.
    with param.edit_constant(page):
        page.busy = False
    page.param.watch(lambda event: _set_theme(session, event.new), "dark_theme")
    system.is_dark = page.dark_theme
    _set_theme(session, page.dark_theme)
    system.follow(session.theme)
    session.param.watch(lambda event: system.follow(event.new), "theme")
    pages.draw_first()
    system.param.watch(lambda event: page.param.update(dark_theme=event.new), "is_dark")
    if pn.state.curdoc is not None and pn.state.location is not None:
        # Panel reads the location when it is first asked for, and with it writes a path from the
        # host's root into the template; this replaces it.
        _prepare(pn.state.curdoc)
    ticker.follow(navigation, pages)
    return page


def empty_page(store: SolutionStore, **contents: list[Part]) -> pmui.Page:
    """Return the page of `store` with its title and style, and with `contents` by their place."""
    title = f"plateviz · {store.title}"
    before = _busy_watchers()
    page = pmui.Page(
        title=title,
        # The page's template puts it into an attribute as it is.
        meta_title=escape(title, quote=True),
        sidebar_width=_SIDEBAR_WIDTH,
        theme_config=PAGE_STYLE,
        **contents,
    )
    # The page would show whether the server is busy, for which the server would keep it for ever.
    for watcher in _busy_watchers():
        if watcher not in before:
            pn.state.param.unwatch(watcher)
    return page


def _busy_watchers() -> list[Watcher]:
    return list(pn.state.param.watchers.get("busy", {}).get("value", []))


def build_part(store: SolutionStore) -> pn.Row:
    """Return the dashboard in the light theme as a part of another page, whose keys it leaves."""
    navigation, ticker, pages = _pages(store)
    ticker.follow(navigation, pages)
    sidebar = pn.Column(pages.sidebar, width=_SIDEBAR_WIDTH)
    bar = SelectionBar(navigation)
    report = report_button(navigation, "line")
    main = pn.Column(bar, report, pages, bar.windows, sizing_mode="stretch_width")
    return pn.Row(sidebar, main, sizing_mode="stretch_width")


def _pages(
    store: SolutionStore, window: Window | None = None, rooms: Rooms | None = None
) -> tuple[Navigation, "_Ticker", Pages]:
    navigation, ticker = Navigation(Session(store)), _Ticker()
    navigation.begin(_arguments())
    pn.state.on_session_destroyed(lambda _: navigation.session.close())
    return navigation, ticker, Pages(navigation, ticker.wake, window, rooms)


def _prepare(document: Document) -> None:
    # The figures are already styled, in both themes. A theme that lists these models prevents
    # the page's own theme from restyling them.
    document.theme = Theme(json={"attrs": {name: {} for name in _STYLED}})
    # Panel sets this when it writes the page, which is before there is a session; without it the
    # page would load its style sheets from another host.
    document.template_variables["dist_url"] = get_dist_path()


def _arguments() -> dict[str, str]:
    # Invalid UTF-8 is replaced; the result is no valid selection and is ignored.
    return {k: v[0].decode("utf-8", "replace") for k, v in pn.state.session_args.items()}


def _window() -> Window | None:
    """Return the window of the browser, if its page has told of it."""
    context = pn.state.curdoc.session_context if pn.state.curdoc is not None else None
    # A page that Panel makes elsewhere has no token.
    return window_from(getattr(context, "token_payload", {}).get(WINDOW))


class _Ticker:
    """Follows job and run, draws figures that are due and completes the page, while there is need.

    A job belongs to the server and may outlive the page: it calls when it is over, and what it
    says in between is looked at now and then.
    """

    def __init__(self) -> None:
        self._progress = pn.state.add_periodic_callback(
            self._tick, period=_PROGRESS_MILLISECONDS, start=False
        )
        self._looks = pn.state.add_periodic_callback(self._look, period=_LOOK, start=False)
        self._navigation: Navigation | None = None
        self._pages: Pages | None = None
        self._watched: Job | None = None
        self._document: Document | None = None
        self._loop: IOLoop | None = None
        self._is_to_tick = False
        self._rest: AtRest | None = None
        self._looks_for_run: AtRest | None = None

    def follow(self, navigation: Navigation, pages: Pages) -> None:
        """Begin once the page has loaded; drawing before would delay it."""
        session = navigation.session
        session.param.watch(self.wake, ["stage", "shown", "other", "theme"])
        session.selection.param.watch(self.wake, ["field", "plates", "detector", *KINDS])
        session.units.param.watch(self.wake, "unit")
        names = ["view", *WORKSPACES.values(), "run_name", "written", "found"]
        navigation.param.watch(self.wake, names)
        navigation.param.watch(self._follow_run, "run_name")

        def begin() -> None:
            self._navigation, self._pages = navigation, pages
            self._document, self._loop = pn.state.curdoc, IOLoop.current()
            # A timer of this page's context would keep the page until its time has come.
            later = (
                None if self._document is None else partial(Context().run, self._loop.call_later)
            )
            self._rest = AtRest(session.prepare_what_ifs, _REST_SECONDS, later)
            self.wake()
            self._follow_run()
            if later is not None:
                self._looks_for_run = AtRest(self._look_soon, _LOOK_FOR_RUN_SECONDS, later)
                self._looks_for_run.begin()

        pn.state.onload(begin)

    def wake(self, *_: object) -> None:
        """Tick until nothing is left to do."""
        if self._navigation is None or self._is_to_tick:
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

    def _call(self) -> None:
        """Tick soon; called from any thread."""
        if self._loop is not None:
            self._loop.add_callback(self.wake)

    def _follow_run(self, *_: object) -> None:
        """Look again and again what a run has that is not complete."""
        if self._navigation is not None and self._navigation.growth and not self._looks.running:
            self._looks.start()

    def _look(self) -> None:
        if self._pages is not None and self._pages.is_due:
            # A table that the browser is still making takes no other rows.
            return
        if self._navigation is None or not self._navigation.look_again():
            self._looks.stop()

    @property
    def _has_ended(self) -> bool:
        """Whether the page has been closed; a timer or a job may come before it is forgotten."""
        return self._document is None or self._document.session_context is None

    def _look_soon(self) -> None:
        if self._document is not None and not self._has_ended:
            self._document.add_next_tick_callback(self._look_for_run)

    def _look_for_run(self) -> None:
        if self._navigation is not None and self._looks_for_run is not None:
            look_for_run(self._navigation)
            self._looks_for_run.begin()

    def _tick(self) -> None:
        self._is_to_tick = False
        if self._navigation is None or self._pages is None:
            return
        session = self._navigation.session
        # What follows from a new solution is sent as one message.
        with pn.io.hold(), one_search(self._document):
            session.poll()
            session.judging.look()
            self._pages.draw_due()
        job = session.job
        if job is not None and job is not self._watched:
            self._watched = job
            job.watch(self._call)
            self._start_looking()
        is_pending = self._pages.is_pending or session.judging.is_any_pending
        if is_pending and self._document is not None:
            # Another thread is at work, and would wait for a page that asks without a pause.
            self._is_to_tick = True
            self._document.add_timeout_callback(self._tick, _PENDING_MILLISECONDS)
        elif is_pending or self._pages.is_due or self._pages.complete(_is_brief(job)):
            self.wake()
        elif job is None:
            if self._progress.running:
                self._progress.stop()
            self._navigation.expect_orbit()
            if self._rest is not None:
                self._rest.begin()


def _is_brief(job: Job | None) -> bool:
    return job is not None and job.seconds < _CONTROLS_SECONDS


def _set_theme(session: Session, is_dark: bool) -> None:
    session.theme = "dark" if is_dark else "light"
