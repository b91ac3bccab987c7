"""The dashboard: one page, made anew for every browser session over a shared store."""

import panel as pn
import panel_material_ui as pmui
import param
from bokeh.document import Document
from bokeh.themes import Theme
from panel.io.resources import get_dist_path

from plateviz.dashboard.navigation import Navigation, View
from plateviz.dashboard.session import Session
from plateviz.dashboard.views.pages import Pages
from plateviz.solving.solution_store import SolutionStore

_TICK_MILLISECONDS = 100
_SIDEBAR_WIDTH = 300
_STYLED = ("Plot", "Title", "Axis", "Grid", "Legend", "ColorBar")


def build_app(store: SolutionStore) -> pmui.Page:
    """Return the page of one session over `store`."""
    navigation, pages = _pages(store)
    session = navigation.session
    page = pmui.Page(
        title=f"plateviz · {store.title}",
        sidebar=[pages.sidebar],
        main=[pages],
        sidebar_width=_SIDEBAR_WIDTH,
        theme_config={"typography": {"fontSize": 13}},
    )
    if pn.state.curdoc is not None:
        _prepare(pn.state.curdoc)
    # The page's busy light changes with every event, and each change of the page makes Panel
    # walk all models of all figures: half a second every time. The refit panel says it instead.
    with param.edit_constant(page):
        page.busy = False
    page.param.watch(lambda event: _set_theme(session, event.new), "dark_theme")
    _set_theme(session, page.dark_theme)
    _write_address(navigation)
    _keep_up(navigation, pages)
    return page


def build_part(store: SolutionStore) -> pn.Row:
    """Return the same, light, as a part of another page."""
    navigation, pages = _pages(store)
    _keep_up(navigation, pages)
    sidebar = pn.Column(pages.sidebar, width=_SIDEBAR_WIDTH)
    return pn.Row(sidebar, pages, sizing_mode="stretch_width")


def _pages(store: SolutionStore) -> tuple[Navigation, Pages]:
    navigation = Navigation(Session(store))
    navigation.begin(_arguments())
    return navigation, Pages(navigation)


def _prepare(document: Document) -> None:
    # Figures come styled, in both themes; a theme that names these models keeps the page's
    # own style off them.
    document.theme = Theme(json={"attrs": {name: {} for name in _STYLED}})
    # Where a browser loads so slowly that its session was given up and is made anew, Panel has
    # not set this yet, and would have the style sheets fetched from far away.
    document.template_variables["dist_url"] = get_dist_path()


def _arguments() -> dict[str, str]:
    # Nobody can type bytes that are no text; what is left of them is no selection either.
    return {k: v[0].decode("utf-8", "replace") for k, v in pn.state.session_args.items()}


def _write_address(navigation: Navigation) -> None:
    """Write what is on the screen into the page's address when it changes."""
    location = pn.state.location
    if location is None:
        return

    def write(*_: object) -> None:
        if navigation.view is not View.ORBIT or navigation.session.shown is not None:
            # Panel declares each value as a mapping; it takes anything that has words.
            location.update_query(**navigation.address())  # type: ignore[arg-type]

    navigation.param.watch(write, ["view", "run_name", "found"])
    navigation.session.param.watch(write, "shown")
    navigation.session.selection.param.watch(write, ["orbit", "field", "plates", "detector"])


def _keep_up(navigation: Navigation, pages: Pages) -> None:
    """Ask for news of the job and draw what is due, for as long as there is any.

    The page asks, it is not told: a job belongs to the server and outlives the page.
    """
    session = navigation.session

    def tick() -> None:
        session.poll()
        pages.draw_due()
        if session.job is None and not pages.is_due:
            callback.stop()

    def wake(*_: object) -> None:
        if not callback.running:
            callback.start()

    callback = pn.state.add_periodic_callback(tick, period=_TICK_MILLISECONDS, start=False)
    session.param.watch(wake, ["stage", "shown", "other", "theme"])
    session.selection.param.watch(wake, ["field", "plates", "detector"])
    navigation.param.watch(wake, ["view", "run_name", "found"])
    pages.on_sight(wake)
    # Drawing before the page is there would keep it from coming.
    pn.state.onload(wake)


def _set_theme(session: Session, is_dark: bool) -> None:
    session.theme = "dark" if is_dark else "light"
