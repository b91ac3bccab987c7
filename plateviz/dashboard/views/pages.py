"""Pages: the views of one browser session behind one switch."""

from collections.abc import Callable

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation import Navigation, View
from plateviz.dashboard.views.orbit import OrbitPage
from plateviz.dashboard.views.source import SourcePage
from plateviz.dashboard.views.survey import SurveyPage

# Figures that keep their size need not be laid out anew when they are seen again; and a
# browser that can leaves out what is in a hidden view, whatever that says of itself.
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
# The views share one scroll bar; each is begun at its head.
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
        # All boxes around the figures are of a kind that keeps its changes to itself: within a
        # plain column, every change has all figures of all views laid out anew.
        self._places = {view: page.__panel__() for view, page in self._pages.items()}
        self._sides = {view: page.sidebar for view, page in self._pages.items()}
        self._column = pmui.Column(
            self._switch(),
            *self._places.values(),
            sizing_mode="stretch_width",
            margin=(4, 16, 24, 16),
        )
        self.sidebar = pmui.Column(*self._sides.values(), sizing_mode="stretch_width", margin=0)
        navigation.param.watch(self._turn, "view")
        self._turn()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the switch and the view."""
        return self._column

    @property
    def is_due(self) -> bool:
        """Whether some figure of the view on the screen is to be drawn."""
        return self._pages[self._navigation.view].figures.is_due

    def on_sight(self, call: Callable[[object], object]) -> None:
        """Have `call` called when somebody comes near a figure, or leaves it."""
        for page in self._pages.values():
            page.figures.on_sight(call)

    def draw_due(self) -> None:
        """Draw the first few figures that are due; what nobody looks at is not drawn."""
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

    def _turn(self, *_: object) -> None:
        shown = self._navigation.view
        for view in View:
            self._places[view].styles = _SHOWN if view is shown else _HIDDEN
            self._sides[view].visible = view is shown
