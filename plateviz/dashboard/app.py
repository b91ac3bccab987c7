"""The dashboard: one page per browser session, over a shared solution store."""

from html import escape
from urllib.parse import urlencode

import panel as pn
import panel_material_ui as pmui
import param
from bokeh.document import Document
from bokeh.themes import Theme
from panel.io.resources import get_dist_path
from param.parameterized import Watcher

from plateviz.dashboard.navigation import WORKSPACES, Navigation, View
from plateviz.dashboard.page_request import WINDOW
from plateviz.dashboard.rooms import Rooms, Window, window_from
from plateviz.dashboard.session import Session
from plateviz.dashboard.views.figure import Part
from plateviz.dashboard.views.keyboard import Keyboard
from plateviz.dashboard.views.pages import Pages
from plateviz.dashboard.views.selection_bar import SelectionBar
from plateviz.dashboard.views.system_theme import SystemTheme
from plateviz.solving.solution_store import SolutionStore

_TICK_MILLISECONDS = 30
# Milliseconds between two looks at a run that is not complete.
_LOOK = 2000
# Figures that are drawn before the page is shown, if their rooms are known.
_FIRST_FIGURES = 1
_SIDEBAR_WIDTH = 300
_STYLED = ("Plot", "Title", "Axis", "Grid", "Legend", "ColorBar")


def build_app(store: SolutionStore, rooms: Rooms | None = None) -> pmui.Page:
    """Return the page of one session over `store`.

    Parameters
    ----------
    rooms : of the cards of earlier pages, with which the first figures are drawn at once
    """
    window = _window()
    navigation, ticker, pages = _pages(store, window, rooms)
    session = navigation.session
    bar, system = SelectionBar(navigation), SystemTheme()
    page = empty_page(
        store,
        header=[bar, Keyboard(navigation), system],
        sidebar=[pages.sidebar],
        main=[pages, bar.windows],
    )
    # The page's busy indicator changes with every event, and each change makes Panel walk all
    # models of all figures, which takes half a second. The refit panel shows progress instead.
    with param.edit_constant(page):
        page.busy = False
    page.param.watch(lambda event: _set_theme(session, event.new), "dark_theme")
    if window is not None:
        page.dark_theme = system.is_dark = window.is_dark
    _set_theme(session, page.dark_theme)
    for _ in range(_FIRST_FIGURES):
        pages.draw_due()
    system.param.watch(lambda event: page.param.update(dark_theme=event.new), "is_dark")
    _write_address(navigation)
    if pn.state.curdoc is not None:
        # After the page's address is known, with which Panel makes a path from the host's root.
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
        theme_config={"typography": {"fontSize": 13}},
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
    main = pn.Column(bar, pages, bar.windows, sizing_mode="stretch_width")
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
    return None if context is None else window_from(context.token_payload.get(WINDOW))


def _write_address(navigation: Navigation) -> None:
    """Update the page's address when the view or the selection changes."""
    location = pn.state.location
    if location is None:
        return

    def write(*_: object) -> None:
        if navigation.view is not View.ORBIT or navigation.session.shown is not None:
            # As a whole: what is no longer selected is not in it.
            location.search = f"?{urlencode(navigation.address(), safe=',')}"

    navigation.param.watch(write, ["view", *WORKSPACES.values(), "run_name", "found"])
    navigation.exploration.param.watch(write, list(navigation.exploration.param.values()))
    navigation.session.param.watch(write, "shown")
    navigation.session.selection.param.watch(
        write, ["orbit", "field", "plates", "detector", "sources"]
    )


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
