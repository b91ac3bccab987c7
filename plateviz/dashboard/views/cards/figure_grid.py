"""FigureGrid: the cards of a workspace, on a large screen in rows of one height."""

import time
from collections.abc import Callable, Mapping, Sequence

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.selection.selected import SelectedIds
from plateviz.dashboard.serving.model_search import one_search
from plateviz.dashboard.serving.rooms import Room
from plateviz.dashboard.views.cards.figure import FigureView, Part

# Figures that are drawn for the first time at once; after each batch, Bokeh goes through all models
# of the page.
_BATCH = 3
# Narrowest window with the columns of a large screen, pixels.
_LARGE = 1536
# Time in which the browser lays out a page that has been opened.
_SETTLING_SECONDS = 10.0


class FigureGrid(pn.viewable.Viewer):
    """Cards that fill the area they are given, in rows without a hole."""

    def __init__(
        self,
        views: Sequence[FigureView],
        wake: Callable[..., object],
        *,
        columns: int = 2,
        columns_if_wide: int | None = None,
        first: Sequence[Part] = (),
        others: Sequence[Part] = (),
        **params: object,
    ) -> None:
        """Arrange the cards in order.

        Parameters
        ----------
        wake : called when a figure comes near the screen, leaves it, or gets another size
        columns : at most, where there is room
        columns_if_wide : on a large screen; None for `columns`. Of five cards, the last two wide,
            three stand above two there
        first, others : cards before and after those of the figures
        """
        super().__init__(**params)
        self._views = list(views)
        for view in self._views:
            view.visibility.param.watch(wake, ["is_near", "room"])
        n_places = len(first) + len(self._views) + len(others)
        if columns == 2 and n_places % 2:
            next((v for v in self._views if v.is_wide), self._views[-1]).take_row()
        are_wide = [view.is_wide for view in self._views]
        if columns == 2 and n_places == 5 and are_wide == 3 * [False] + 2 * [True]:
            columns_if_wide = 6
            for view in self._views:
                view.take_columns("span 3" if view.is_wide else "span 2", least_width=_LARGE)
        self._box = pmui.FlexBox(
            *first,
            *self._views,
            *others,
            sx={
                "display": "grid",
                "gap": "8px",
                "gridTemplateColumns": {
                    "xs": "minmax(0, 1fr)",
                    "lg": f"repeat({columns}, minmax(0, 1fr))",
                    "xl": f"repeat({columns_if_wide or columns}, minmax(0, 1fr))",
                },
                "gridAutoFlow": "dense",
                # Each card says how high it is at least. In a narrow window these heights differ.
                "gridAutoRows": {"xs": "auto", "xl": "minmax(auto, 1fr)"},
            },
            styles={"align-self": "stretch", "height": "auto"},
            stylesheets=[".flex-box { height: 100%; }"],
            sizing_mode="stretch_width",
            margin=0,
        )

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the cards."""
        return self._box

    @property
    def is_due(self) -> bool:
        """Whether any figure is to be drawn."""
        return any(view.is_due for view in self._views)

    @property
    def is_pending(self) -> bool:
        """Whether another thread makes a figure."""
        return any(view.is_due and view.is_pending for view in self._views)

    @property
    def is_laid_out(self) -> bool:
        """Whether the browser has said how large any card is."""
        return any(min(view.visibility.room) > 0 for view in self._views)

    @property
    def cards(self) -> list[str]:
        """Names of the figures in order."""
        return [view.card_name for view in self._views]

    def begin_with(self, rooms: Mapping[str, Room], note: Callable[[str, Room], object]) -> None:
        """Begin with the rooms that cards had on an earlier page.

        Parameters
        ----------
        rooms : of the cards on the screen, by name
        note : called with the name and the room of a card when the browser says that it differs
        """
        until = time.monotonic() + _SETTLING_SECONDS

        def take(view: FigureView) -> None:
            # Later it is a person who changes the window, or opens a card large.
            if view.visibility.is_near and time.monotonic() < until:
                width, height = view.visibility.room
                note(view.card_name, (width, height))

        for view in self._views:
            if view.card_name in rooms:
                room = list(rooms[view.card_name])
                view.visibility.param.update(room=room, is_near=True)
            view.visibility.param.watch(lambda *_, view=view: take(view), ["is_near", "room"])

    def change(self, theme: str) -> None:
        """Mark all figures as changed, and set their theme."""
        for view in self._views:
            view.change(theme)

    def show_selected(self, ids: SelectedIds) -> None:
        """Show what is selected in all figures."""
        for view in self._views:
            view.show_selected(ids)

    def mark_stale(self, is_stale: bool) -> None:
        """Mark all figures as stale while a new solution is being computed."""
        for view in self._views:
            view.mark_stale(is_stale)

    def draw_due(self, most_new: int = _BATCH) -> None:
        """Let all due figures follow that are drawn, and draw the first few of the others.

        A first drawing changes the page, which takes a while. With batches, the page opens at
        once, fills from the top, and remains responsive.

        Parameters
        ----------
        most_new : number of figures that are drawn for the first time
        """
        due = [view for view in self._views if view.is_due]
        new = [view for view in due if not view.is_drawn]
        with pn.io.hold(), one_search(pn.state.curdoc):
            for view in [view for view in due if view.is_drawn] + new[:most_new]:
                view.draw()
