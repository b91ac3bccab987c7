"""Pages: the views of one browser session, with a switch between them and their workspaces."""

from collections.abc import Callable
from functools import partial

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation.navigation import WORKSPACES, Navigation, View
from plateviz.dashboard.serving.rooms import BrowserWindow, Rooms
from plateviz.dashboard.views.browser.to_the_top import ToTheTop
from plateviz.dashboard.views.cards.figure_grid import FigureGrid
from plateviz.dashboard.views.elements.notice import NoticeView
from plateviz.dashboard.views.elements.stack import Stack
from plateviz.dashboard.views.pages.orbit import OrbitPage
from plateviz.dashboard.views.pages.source import SourcePage
from plateviz.dashboard.views.pages.survey import SurveyPage
from plateviz.plots.workspace import title_of

# In a narrow window the buttons take two lines; none is cut off.
_SWITCH = {
    "flexWrap": "wrap",
    "& .MuiToggleButton-root": {
        "textTransform": "none",
        "fontSize": "14px",
        "px": 1.5,
        "py": 0.5,
        "whiteSpace": "nowrap",
        "width": "auto",
    },
}
_WITHIN_PAGE = {"max-width": "100%"}
# Its grey on grey would be hard to read; a rule of the theme would take precedence over one "&".
_SELECTED = {
    "&& .MuiToggleButton-root.Mui-selected, && .MuiToggleButton-root.Mui-selected:hover": {
        "color": "text.primary",
        "backgroundColor": "action.selected",
    }
}
_TYPES = {View.SURVEY: SurveyPage, View.ORBIT: OrbitPage, View.SOURCE: SourcePage}

Page = SurveyPage | OrbitPage | SourcePage


class Pages(pn.viewable.Viewer):
    """The view that is on the screen, below the switches; each is made when it is first shown."""

    def __init__(
        self,
        navigation: Navigation,
        wake: Callable[..., object],
        window: BrowserWindow | None = None,
        rooms: Rooms | None = None,
        **params: object,
    ) -> None:
        """Follow the view of `navigation`.

        Parameters
        ----------
        wake : called when a figure may have become due to be drawn
        window : of the browser, if it has told
        rooms : of the cards of earlier pages
        """
        super().__init__(**params)
        self._navigation, self._wake = navigation, wake
        self._window, self._rooms = window, rooms
        self._furnished: set[FigureGrid] = set()
        self._pages: dict[View, Page] = {}
        self._stack = Stack({view: lambda view=view: self._page(view).__panel__() for view in View})
        self.sidebar = Stack({view: lambda view=view: self._page(view).sidebar for view in View})
        self._column = pmui.Column(
            pmui.FlexBox(
                self._view_switch(), self._workspace_switch(), sizing_mode="stretch_width", margin=0
            ),
            NoticeView(navigation.session),
            ToTheTop(navigation),
            self._stack,
            sizing_mode="stretch_width",
            margin=(0, 12, 8, 12),
        )
        navigation.param.watch(self._show_view, "view")
        self._show_view()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the switches and the view."""
        return self._column

    @property
    def is_due(self) -> bool:
        """Whether any figure on the screen is to be drawn."""
        return self._figures.is_due

    @property
    def is_pending(self) -> bool:
        """Whether another thread makes a part of what is on the screen."""
        page = self._page(self._navigation.view)
        is_read = isinstance(page, OrbitPage) or not page.is_pending
        return page.figures.is_pending or not is_read

    def draw_due(self) -> None:
        """Draw the first few figures that are due on the screen, and show a run that is read."""
        page = self._page(self._navigation.view)
        if not isinstance(page, OrbitPage):
            page.look()
        self._figures.draw_due()

    def draw_first(self) -> None:
        """Draw the first figure on the screen, if its room is known."""
        self._figures.draw_due(most_new=1)

    @property
    def _figures(self) -> FigureGrid:
        """The figures on the screen; at first with the rooms that they had on earlier pages."""
        grid = self._page(self._navigation.view).figures
        if grid not in self._furnished:
            self._furnished.add(grid)
            if self._window is not None and self._rooms is not None:
                cards = grid.cards
                note = partial(self._rooms.note, self._window, cards)
                grid.begin_with(self._rooms.of(self._window, cards), note)
        return grid

    def complete(self, is_fitting: bool) -> bool:
        """Make a part of the page that can wait for the figures; return whether there was one.

        Parameters
        ----------
        is_fitting : whether a fit has just begun, for which some parts wait
        """
        page = self._page(self._navigation.view)
        return isinstance(page, OrbitPage) and page.complete(is_fitting)

    def _page(self, view: View) -> Page:
        if view not in self._pages:
            self._pages[view] = _TYPES[view](self._navigation, self._wake)
        return self._pages[view]

    def _view_switch(self) -> pmui.RadioButtonGroup:
        navigation = self._navigation
        switch = pmui.RadioButtonGroup(
            options={view.value.capitalize(): view for view in View},
            value=navigation.view,
            size="small",
            color="primary",
            margin=(6, 24, 6, 2),
            sx=_SWITCH,
            styles=_WITHIN_PAGE,
        )
        switch.param.watch(lambda event: navigation.turn_to(event.new), "value")
        navigation.param.watch(lambda event: switch.param.update(value=event.new), "view")
        return switch

    def _workspace_switch(self) -> pmui.RadioButtonGroup:
        navigation = self._navigation
        switch = pmui.RadioButtonGroup(
            options={},
            size="small",
            color="default",
            margin=(6, 2),
            sx={**_SWITCH, **_SELECTED},
            styles=_WITHIN_PAGE,
        )

        def follow(*_: object) -> None:
            options = {title_of(one): one for one in navigation.workspaces_of_view}
            switch.param.update(options=options, value=navigation.workspace)

        def choose(event: object) -> None:
            navigation.turn_to_workspace(event.new)  # type: ignore[attr-defined]

        follow()
        switch.param.watch(choose, "value")
        navigation.param.watch(follow, ["view", *WORKSPACES.values()])
        return switch

    def _show_view(self, *_: object) -> None:
        self._stack.show(self._navigation.view)
        self.sidebar.show(self._navigation.view)
