"""The dashboard: one page per browser session, over a shared solution store."""

from html import escape

import panel as pn
import panel_material_ui as pmui
import param
from bokeh.document import Document
from bokeh.themes import Theme
from panel.io.resources import get_dist_path
from param.parameterized import Watcher

from plateviz.dashboard.address_parts import repeated_parts
from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.selection.large_selections import LargeSelections
from plateviz.dashboard.serving.page_request import WINDOW
from plateviz.dashboard.serving.rooms import BrowserWindow, Rooms, browser_window_from
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.ticker import Ticker
from plateviz.dashboard.views.browser.accessible_names import AccessibleNames
from plateviz.dashboard.views.browser.address_bar import AddressBar
from plateviz.dashboard.views.browser.browser_session import BrowserSession
from plateviz.dashboard.views.browser.figure_painting import FigurePainting
from plateviz.dashboard.views.browser.system_theme import SystemTheme
from plateviz.dashboard.views.cards.figure import Part
from plateviz.dashboard.views.controls.keyboard import Keyboard
from plateviz.dashboard.views.controls.selection_bar import SelectionBar
from plateviz.dashboard.views.elements.page_style import PAGE_STYLE
from plateviz.dashboard.views.pages.pages import Pages
from plateviz.dashboard.views.saving.report_button import report_button
from plateviz.dashboard.views.saving.view_file import ViewFile
from plateviz.solving.solution_store import SolutionStore

_SIDEBAR_WIDTH = 264
_STYLED = ("Plot", "Title", "Axis", "Grid", "Legend", "ColorBar")


def build_app(
    store: SolutionStore, rooms: Rooms | None = None, large: LargeSelections | None = None
) -> pmui.Page:
    """Return the page of one session over `store`.

    Parameters
    ----------
    rooms : of the cards of earlier pages, with which the first figures are drawn at once
    large : selections of all sessions that are too large for an address
    """
    window = _window()
    if window is not None and window.is_dark:
        # The first component that the browser makes decides the theme of all.
        pn.config.theme = "dark"  # type: ignore[assignment]
    navigation, ticker, pages = _pages(store, window, rooms, large)
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
    store: SolutionStore,
    window: BrowserWindow | None = None,
    rooms: Rooms | None = None,
    large: LargeSelections | None = None,
) -> tuple[Navigation, Ticker, Pages]:
    navigation, ticker = Navigation(Session(store, large)), Ticker()
    navigation.begin(_arguments())
    navigation.session.note(repeated_parts(pn.state.session_args))
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


def _window() -> BrowserWindow | None:
    """Return the window of the browser, if its page has told of it."""
    context = pn.state.curdoc.session_context if pn.state.curdoc is not None else None
    # A page that Panel makes elsewhere has no token.
    return browser_window_from(getattr(context, "token_payload", {}).get(WINDOW))


def _set_theme(session: Session, is_dark: bool) -> None:
    session.theme = "dark" if is_dark else "light"
