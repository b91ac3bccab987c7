"""The dashboard: one page per browser session, over a shared solution store."""

from html import escape

import panel as pn
import panel_material_ui as pmui
import param
from bokeh.document import Document
from bokeh.themes import Theme
from panel.io.resources import get_dist_path

from plateviz.dashboard.navigation import WORKSPACES, Navigation
from plateviz.dashboard.session import Session
from plateviz.dashboard.views.address_bar import AddressBar
from plateviz.dashboard.views.browser_session import BrowserSession
from plateviz.dashboard.views.keyboard import Keyboard
from plateviz.dashboard.views.pages import Pages
from plateviz.dashboard.views.selection_bar import SelectionBar
from plateviz.dashboard.views.system_theme import SystemTheme
from plateviz.dashboard.views.view_file import ViewFile
from plateviz.solving.solution_store import SolutionStore

_TICK_MILLISECONDS = 30
# Milliseconds between two looks at a run that is not complete.
_LOOK = 2000
_SIDEBAR_WIDTH = 300
_STYLED = ("Plot", "Title", "Axis", "Grid", "Legend", "ColorBar")


def build_app(store: SolutionStore) -> pmui.Page:
    """Return the page of one session over `store`."""
    navigation, ticker, pages = _pages(store)
    session, title = navigation.session, f"plateviz · {store.title}"
    bar, system = SelectionBar(navigation), SystemTheme()
    page = pmui.Page(
        title=title,
        # The page's template puts it into an attribute as it is.
        meta_title=escape(title, quote=True),
        header=[
            bar,
            ViewFile(navigation),
            Keyboard(navigation),
            system,
            AddressBar(navigation),
            BrowserSession(session.journal),
        ],
        sidebar=[pages.sidebar],
        main=[pages, bar.windows],
        sidebar_width=_SIDEBAR_WIDTH,
        theme_config={"typography": {"fontSize": 13}},
    )
    if pn.state.curdoc is not None:
        _prepare(pn.state.curdoc)
    # The page's busy indicator changes with every event, and each change makes Panel walk all
    # models of all figures, which takes half a second. The refit panel shows progress instead.
    with param.edit_constant(page):
        page.busy = False
    page.param.watch(lambda event: _set_theme(session, event.new), "dark_theme")
    _set_theme(session, page.dark_theme)
    system.param.watch(lambda event: page.param.update(dark_theme=event.new), "is_dark")
    ticker.follow(navigation, pages)
    return page


def build_part(store: SolutionStore) -> pn.Row:
    """Return the dashboard in the light theme as a part of another page, whose keys it leaves."""
    navigation, ticker, pages = _pages(store)
    ticker.follow(navigation, pages)
    sidebar = pn.Column(pages.sidebar, width=_SIDEBAR_WIDTH)
    bar = SelectionBar(navigation)
    main = pn.Column(bar, pages, bar.windows, sizing_mode="stretch_width")
    return pn.Row(sidebar, main, sizing_mode="stretch_width")


def _pages(store: SolutionStore) -> tuple[Navigation, "_Ticker", Pages]:
    navigation, ticker = Navigation(Session(store)), _Ticker()
    navigation.begin(_arguments())
    return navigation, ticker, Pages(navigation, ticker.wake)


def _prepare(document: Document) -> None:
    # The figures are already styled, in both themes. A theme that lists these models prevents
    # the page's own theme from restyling them.
    document.theme = Theme(json={"attrs": {name: {} for name in _STYLED}})
    # If a browser loads so slowly that its session has expired and is created again, Panel has
    # not set this yet, and the page would load its style sheets from another host.
    document.template_variables["dist_url"] = get_dist_path()


def _arguments() -> dict[str, str]:
    # Invalid UTF-8 is replaced; the result is no valid selection and is ignored.
    return {k: v[0].decode("utf-8", "replace") for k, v in pn.state.session_args.items()}


class _Ticker:
    """Polls job and run, draws figures that are due and completes the page, while there is need.

    The page polls because a job belongs to the server and may outlive the page.
    """

    def __init__(self) -> None:
        self._callback = pn.state.add_periodic_callback(
            self._tick, period=_TICK_MILLISECONDS, start=False
        )
        self._looks = pn.state.add_periodic_callback(self._look, period=_LOOK, start=False)
        self._navigation: Navigation | None = None
        self._pages: Pages | None = None

    def follow(self, navigation: Navigation, pages: Pages) -> None:
        """Begin once the page has loaded; drawing before would delay it."""
        session = navigation.session
        session.param.watch(self.wake, ["stage", "shown", "other", "theme"])
        session.selection.param.watch(self.wake, ["field", "plates", "detector", "sources"])
        names = ["view", *WORKSPACES.values(), "run_name", "written", "found"]
        navigation.param.watch(self.wake, names)
        navigation.param.watch(self._follow_run, "run_name")

        def begin() -> None:
            self._navigation, self._pages = navigation, pages
            self.wake()
            self._follow_run()

        pn.state.onload(begin)

    def wake(self, *_: object) -> None:
        """Tick until nothing is left to do."""
        if self._pages is not None and not self._callback.running:
            self._callback.start()
            if pn.state.curdoc is not None:
                # The first figures follow at once, not after the first interval.
                pn.state.curdoc.add_next_tick_callback(self._tick)

    def _follow_run(self, *_: object) -> None:
        """Look again and again what a run has that is not complete."""
        if self._navigation is not None and self._navigation.growth and not self._looks.running:
            self._looks.start()

    def _look(self) -> None:
        if self._navigation is None or not self._navigation.look_again():
            self._looks.stop()

    def _tick(self) -> None:
        if self._navigation is None or self._pages is None:
            return
        session = self._navigation.session
        session.poll()
        self._pages.draw_due()
        if session.job is None and not self._pages.is_due and not self._pages.complete():
            self._callback.stop()
            session.prepare_what_ifs()


def _set_theme(session: Session, is_dark: bool) -> None:
    session.theme = "dark" if is_dark else "light"
