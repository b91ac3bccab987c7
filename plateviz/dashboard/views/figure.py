"""FigureView: one figure on the screen, with its caption and the state it is in."""

import logging
from collections.abc import Callable, Sequence
from types import MappingProxyType
from typing import Protocol

import holoviews as hv
import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.views.links import Links, follow_taps, rendered
from plateviz.dashboard.views.markup import markup_pane, paragraph
from plateviz.dashboard.views.visibility import Visibility
from solver.errors import InputError

_BATCH = 2
# An empty card has about the height of a figure: if it had none, all cards would be near.
_EMPTY_HEIGHT = 420
_NOWHERE: Links = MappingProxyType({})
_LOG = logging.getLogger(__name__)

Picture = Callable[[str], hv.core.Dimensioned | None]
"""Gives what a figure shows in a theme; None while there is nothing to draw it from."""


class FigureText(Protocol):
    """What a card says of its figure."""

    @property
    def name(self) -> str:
        """Short and unique, used in class names."""
        ...

    @property
    def caption(self) -> str:
        """What it shows and what good looks like."""
        ...

    @property
    def is_wide(self) -> bool:
        """Whether it takes the whole width of the page."""
        ...


class FigureView(pn.viewable.Viewer):
    """A card with one figure; due to be drawn when what it is drawn from changes.

    A figure that has still to be drawn anew is faded.
    """

    def __init__(
        self,
        figure: FigureText,
        picture: Picture,
        *,
        waiting: str = "",
        links: Links = _NOWHERE,
        **params: object,
    ) -> None:
        """Show `figure` as `picture` gives it.

        Parameters
        ----------
        waiting : words for as long as there is nothing to draw
        links : where a tap on a point links
        """
        super().__init__(**params)
        self._figure, self._picture, self._leads = figure, picture, links
        self._waiting, self._theme = waiting, "light"
        self._is_changed = self._is_stale = False
        self.visibility = Visibility()
        self._caption = markup_pane()
        # A plain column lays a new figure out as it takes it; others do so a moment later, in which
        # the page may measure a figure that has no layout yet.
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
        self._say("Being drawn.")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the card."""
        return self._card

    @property
    def is_due(self) -> bool:
        """Whether it is to be drawn: it has changed, and somebody looks at it or soon will."""
        return self._is_changed and self.visibility.is_near

    def change(self, theme: str) -> None:
        """Take note that the figure, or the theme it is drawn in, is another."""
        self._theme, self._is_changed = theme, True
        self._caption.object = paragraph(self._figure.caption, "caption", theme)
        self._fade()

    def draw(self) -> None:
        """Draw the figure as it is now."""
        self._is_changed = False
        try:
            element = self._picture(self._theme)
            if element is None:
                self._say(self._waiting)
            else:
                self._show(element)
        except (InputError, ValueError, KeyError, TypeError, ArithmeticError) as error:
            # One figure that cannot be drawn must not take the page with it.
            _LOG.exception("%s cannot be drawn", self._figure.name)
            self._say(f"This figure cannot be drawn: {error}")

    def mark_stale(self, is_stale: bool) -> None:
        """Take note that another is being made, or no longer is."""
        self._is_stale = is_stale
        self._fade()

    def _show(self, element: hv.core.Dimensioned) -> None:
        plot = rendered(element)
        follow_taps(plot, self._leads)
        self._put(
            pn.pane.HoloViews(plot, backend="bokeh", linked_axes=False, align="center", margin=0)
        )

    def _say(self, words: str) -> None:
        pane = markup_pane()
        pane.object = paragraph(words, "empty", self._theme)
        self._put(pane)

    def _put(self, body: pn.viewable.Viewable) -> None:
        self._body[:] = [body]
        self._fade()

    def _fade(self) -> None:
        self._body.styles = {"opacity": "0.45" if self._is_changed or self._is_stale else "1"}


class FigureGrid(pn.viewable.Viewer):
    """Several figures, two in a row where there is room."""

    def __init__(self, views: Sequence[FigureView], **params: object) -> None:
        """Lay out the cards, in order."""
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
        """Whether some figure is to be drawn."""
        return any(view.is_due for view in self._views)

    def on_sight(self, call: Callable[[object], object]) -> None:
        """Have `call` called when somebody comes near a figure, or leaves it."""
        for view in self._views:
            view.visibility.param.watch(call, "is_near")

    def change(self, theme: str) -> None:
        """Take note that all figures are others."""
        for view in self._views:
            view.change(theme)

    def mark_stale(self, is_stale: bool) -> None:
        """Fade all figures while others are being made."""
        for view in self._views:
            view.mark_stale(is_stale)

    def draw_due(self) -> None:
        """Draw the first few figures that are due.

        Drawing takes tenths of a second, and so does each change of the page: in batches,
        the page opens at once, fills from the top, and answers in between.
        """
        due = [view for view in self._views if view.is_due]
        with pn.io.hold():
            for view in due[:_BATCH]:
                view.draw()
