"""FigureView: a card with one figure, its caption and its state."""

import logging
from collections.abc import Callable, Sequence
from types import MappingProxyType
from typing import Protocol

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.views.markup import markup_pane, paragraph
from plateviz.dashboard.views.tap_links import Links, TapLinks
from plateviz.dashboard.views.visibility import Visibility
from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.figure import Figure
from solver.errors import InputError

_BATCH = 2
# Height of an empty card, about that of a figure; without it, all cards would be near the screen.
_EMPTY_HEIGHT = 420
_NO_LINKS: Links = MappingProxyType({})
_LOG = logging.getLogger(__name__)

PlotFigure = Callable[[], Figure | None]
"""Returns a figure, or None while there are no data."""


class FigureText(Protocol):
    """Name, caption and width of a figure."""

    @property
    def name(self) -> str:
        """Short unique name, used in CSS class names."""
        ...

    @property
    def caption(self) -> str:
        """What the figure shows, and how it looks for a good solution."""
        ...

    @property
    def is_wide(self) -> bool:
        """Whether the figure takes the whole width of the page."""
        ...


class FigureView(pn.viewable.Viewer):
    """A card with one figure, which is due to be drawn when its data change.

    The figure is drawn once; after that, it follows its data in place. Until then it is faded.
    """

    def __init__(
        self,
        figure: FigureText,
        plot_figure: PlotFigure,
        *,
        waiting: str = "",
        links: Links = _NO_LINKS,
        **params: object,
    ) -> None:
        """Show `figure` as `plot_figure` draws it.

        Parameters
        ----------
        waiting : text while there is nothing to draw
        links : actions for a tap on a point
        """
        super().__init__(**params)
        self._figure, self._plot_figure = figure, plot_figure
        self._links = TapLinks(links)
        self._drawn: BokehFigure | None = None
        self._pane: pn.pane.Bokeh | None = None
        self._waiting, self._theme = waiting, "light"
        self._is_changed = self._is_stale = False
        self.visibility = Visibility()
        self._caption = markup_pane()
        # A plain Panel column lays out a new figure at once. Other containers do so a moment later,
        # and the page may measure a figure without a layout.
        self._body = pn.Column(sizing_mode="stretch_width", margin=0)
        self._card = pmui.Paper(
            self.visibility,
            self._caption,
            self._body,
            css_classes=["figure", f"figure-{figure.name}"],
            styles={
                "flex": "1 1 100%" if figure.is_wide else "1 1 520px",
                "min-width": "0",
                "align-self": "stretch",
                "height": "auto",
                "min-height": f"{_EMPTY_HEIGHT}px",
            },
            stylesheets=[".paper { height: 100%; }"],
            margin=6,
            sx={"height": "100%", "position": "relative", "zIndex": 0},
            elevation=0,
            variant="outlined",
        )
        self.change(self._theme)
        self._show_text("Being drawn.")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the card."""
        return self._card

    @property
    def is_due(self) -> bool:
        """Whether the figure is to be drawn: it has changed, and is on or near the screen."""
        return self._is_changed and self.visibility.is_near

    @property
    def is_drawn(self) -> bool:
        """Whether the figure has been drawn, so that it follows its data in place."""
        return self._drawn is not None

    def change(self, theme: str) -> None:
        """Mark the figure as changed, and set the theme for the next drawing."""
        self._theme, self._is_changed = theme, True
        self._caption.object = paragraph(self._figure.caption, "caption", theme)
        self._fade()

    def draw(self) -> None:
        """Draw the figure from the current data."""
        self._is_changed = False
        try:
            figure = self._plot_figure()
            if figure is None:
                self._show_text(self._waiting)
            else:
                self._show(figure)
        except (InputError, ValueError, KeyError, TypeError, ArithmeticError) as error:
            # One figure that cannot be drawn must not break the page.
            _LOG.exception("%s cannot be drawn", self._figure.name)
            self._show_text(f"This figure cannot be drawn: {error}")

    def mark_stale(self, is_stale: bool) -> None:
        """Mark the figure as stale while a new solution is being computed."""
        self._is_stale = is_stale
        self._fade()

    def _show(self, figure: Figure) -> None:
        if self._drawn is None:
            self._drawn = BokehFigure(figure, self._theme)
        else:
            self._drawn.follow(figure, self._theme)
        if self._pane is None or self._pane.object is not self._drawn.model:
            self._pane = pn.pane.Bokeh(self._drawn.model, align="center", margin=0)
        self._links.follow(self._drawn)
        self._put(self._pane)

    def _show_text(self, text: str) -> None:
        pane = markup_pane()
        pane.object = paragraph(text, "empty", self._theme)
        self._put(pane)

    def _put(self, body: pn.viewable.Viewable) -> None:
        if list(self._body) != [body]:
            self._body[:] = [body]
        self._fade()

    def _fade(self) -> None:
        self._body.styles = {"opacity": "0.45" if self._is_changed or self._is_stale else "1"}


class FigureGrid(pn.viewable.Viewer):
    """Several figures, two in a row where there is room."""

    def __init__(self, views: Sequence[FigureView], **params: object) -> None:
        """Arrange the cards in order."""
        super().__init__(**params)
        self._views = list(views)
        self._box = pmui.FlexBox(
            *self._views, align_items="stretch", sizing_mode="stretch_width", margin=(8, 0)
        )

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the cards."""
        return self._box

    @property
    def is_due(self) -> bool:
        """Whether any figure is to be drawn."""
        return any(view.is_due for view in self._views)

    def on_visibility(self, call: Callable[[object], object]) -> None:
        """Call `call` when a figure comes near the screen or leaves it."""
        for view in self._views:
            view.visibility.param.watch(call, "is_near")

    def change(self, theme: str) -> None:
        """Mark all figures as changed, and set their theme."""
        for view in self._views:
            view.change(theme)

    def mark_stale(self, is_stale: bool) -> None:
        """Mark all figures as stale while a new solution is being computed."""
        for view in self._views:
            view.mark_stale(is_stale)

    def draw_due(self) -> None:
        """Let all due figures follow that are drawn, and draw the first few of the others.

        A first drawing changes the page, which takes a while. With batches, the page opens at
        once, fills from the top, and remains responsive.
        """
        due = [view for view in self._views if view.is_due]
        new = [view for view in due if not view.is_drawn]
        with pn.io.hold():
            for view in [view for view in due if view.is_drawn] + new[:_BATCH]:
                view.draw()
