"""Pages: the views of one browser session, with a switch between them."""

from collections.abc import Callable

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation import Navigation, View
from plateviz.dashboard.views.orbit import OrbitPage
from plateviz.dashboard.views.source import SourcePage
from plateviz.dashboard.views.survey import SurveyPage

# A hidden view keeps the size of its figures, so that they need no new layout when it is shown
# again. `content-visibility` lets browsers that support it skip the contents of a hidden view.
_SHOWN = {
    "visibility": "inherit",
    "content-visibility": "visible",
    "height": "auto",
    "overflow": "visible",
}
_HIDDEN = {
    "visibility": "hidden",
    "content-visibility": "hidden",
    "height": "0",
    "overflow": "hidden",
}
# The views share one scroll bar; each opens at its top.
_TO_THE_TOP = """
for (const host of document.querySelectorAll("*"))
  host.shadowRoot?.querySelector(".main-content")?.scrollTo(0, 0)
"""
_SWITCH = {"& .MuiToggleButton-root": {"textTransform": "none", "fontSize": "14px", "px": 2.5}}


class Pages(pn.viewable.Viewer):
    """The view that is on the screen, with the switch between the views above it."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the view of `navigation`."""
        super().__init__(**params)
        self._navigation = navigation
        self._pages = {
            View.SURVEY: SurveyPage(navigation),
            View.ORBIT: OrbitPage(navigation),
            View.SOURCE: SourcePage(navigation),
        }
        # All containers of the figure cards are Material UI ones, whose changes stay local: in a
        # plain Panel column, every change lays out all figures of all views again.
        self._contents = {view: page.__panel__() for view, page in self._pages.items()}
        self._sidebars = {view: page.sidebar for view, page in self._pages.items()}
        self._column = pmui.Column(
            self._switch(),
            *self._contents.values(),
            sizing_mode="stretch_width",
            margin=(4, 16, 24, 16),
        )
        self.sidebar = pmui.Column(*self._sidebars.values(), sizing_mode="stretch_width", margin=0)
        navigation.param.watch(self._show_view, "view")
        self._show_view()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the switch and the view."""
        return self._column

    @property
    def is_due(self) -> bool:
        """Whether any figure of the view on the screen is to be drawn."""
        return self._pages[self._navigation.view].figures.is_due

    def on_visibility(self, call: Callable[[object], object]) -> None:
        """Call `call` when a figure comes near the screen or leaves it."""
        for page in self._pages.values():
            page.figures.on_visibility(call)

    def draw_due(self) -> None:
        """Draw the first few figures that are due in the view on the screen."""
        self._pages[self._navigation.view].figures.draw_due()

    def _switch(self) -> pmui.RadioButtonGroup:
        navigation = self._navigation
        switch = pmui.RadioButtonGroup(
            options={view.value.capitalize(): view for view in View},
            value=navigation.view,
            size="small",
            color="primary",
            margin=(8, 2),
            sx=_SWITCH,
        )
        switch.jscallback(value=_TO_THE_TOP)
        switch.param.watch(lambda event: navigation.turn_to(event.new), "value")
        navigation.param.watch(lambda event: switch.param.update(value=event.new), "view")
        return switch

    def _show_view(self, *_: object) -> None:
        shown = self._navigation.view
        for view in View:
            self._contents[view].styles = _SHOWN if view is shown else _HIDDEN
            self._sidebars[view].visible = view is shown
