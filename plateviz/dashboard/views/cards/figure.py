"""FigureView: a card with one figure and its state."""

import logging
import math
from collections.abc import Callable, Sequence
from itertools import accumulate

import panel as pn
import panel_material_ui as pmui
from bokeh.events import Event, RangesUpdate, Reset

from plateviz.dashboard.selection.selected import NO_IDS, SelectedIds
from plateviz.dashboard.serving.page_request import has_own_scripts
from plateviz.dashboard.session.latest_answer import Pending
from plateviz.dashboard.views.browser.own_layout import OwnLayout
from plateviz.dashboard.views.browser.visibility import FADING, Visibility
from plateviz.dashboard.views.cards.card_tools import CardTools
from plateviz.dashboard.views.cards.figure_text import FigureText
from plateviz.dashboard.views.cards.point_actions import PointActions
from plateviz.dashboard.views.elements.markup import markup_pane, paragraph
from plateviz.dashboard.views.saving.save_button import SaveButton
from plateviz.dashboard.views.saving.save_choices import FigureOnScreen, Saved, figure_choices
from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.figure import Figure, Limits
from plateviz.figures.figure_summary import TextTable, figure_summary, text_tables
from plateviz.figures.resized import resized
from solver.errors import InputError

# Screen pixels between the edge of a card and its figure, and width of its three buttons there.
_INSET, _CORNER = 4, 76
# Least height of a card: two rows of cards fill a screen 768 pixels high.
_LEAST_HEIGHT = 290
# Below these widths of the window, `FigureGrid` has fewer columns, and then one.
_NARROWER = (1536, 1200)
# Fills its card, whatever it shows.
_BODY = {
    "position": "absolute",
    "inset": f"{_INSET}px",
    "width": f"calc(100% - {2 * _INSET}px)",
    "height": f"calc(100% - {2 * _INSET}px)",
    "overflow": "auto",
}
# The titles of all figures begin at the same place of their cards.
_AT_THE_TOP = {
    "overflow": "hidden",
    "display": "flex",
    "align-items": "flex-start",
    "justify-content": "flex-start",
}
_WHAT_TO_DO = "The other figures do not depend on it; it is tried again at the next change."
_LOG = logging.getLogger(__name__)

Part = pn.viewable.Viewable | pn.viewable.Viewer

PlotFigure = Callable[[], Figure | Pending | None]
"""Returns a figure, or None while there are no data; `PENDING` while another thread makes it."""
Zoom = Callable[[tuple[Limits, Limits] | None], object]


class FigureView(pn.viewable.Viewer):
    """A card with one figure, which is due to be drawn when its data or its room change.

    The figure is drawn once; after that, it follows its data in place. Until then it is faded.
    """

    def __init__(
        self,
        figure: FigureText,
        plot_figure: PlotFigure,
        *,
        waiting: str | Callable[[], str] = "",
        actions: PointActions | None = None,
        zoom: Zoom | None = None,
        saved: Saved | None = None,
        theme: str = "light",
        **params: object,
    ) -> None:
        """Show `figure` as `plot_figure` draws it.

        Parameters
        ----------
        waiting : text while there is nothing to draw, or function that returns it
        actions : what its points do
        zoom : called with the limits of the first frame's axes when a person changes them, and
            with None when they are reset
        saved : how the figure is named in files, and what its data are
        theme : of the first drawing
        """
        super().__init__(**params)
        self.is_wide, self.card_name = figure.is_wide, figure.name
        self._plot_figure = plot_figure
        self._actions, self._zoom = actions or PointActions(), zoom
        self._selected = self._shown_selected = NO_IDS
        self._figure: Figure | None = None
        self._drawn: BokehFigure | None = None
        self._pane: pn.pane.Bokeh | None = None
        self._waiting = waiting
        self._is_changed = self._is_stale = self.is_pending = False
        self._shown_room: list[int] = []
        self.visibility = Visibility()
        # A plain Panel column lays out a new figure at once. Other containers do so a moment later,
        # and the page may measure a figure without a layout.
        self._body = pn.Column(margin=0, styles=_BODY | _AT_THE_TOP, css_classes=[FADING])
        self._tools = CardTools(figure, self._text_tables)
        choices = figure_choices(figure.name, self._on_screen, saved or Saved())
        self._save = SaveButton(figure.title, choices, place="corner")
        heights = figure.least_height, figure.narrow_height, figure.column_height
        self._card = _card(self.visibility, self._body, name=figure.name, least_heights=heights)
        self.change(theme)
        self._show_text("Being drawn.")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the card."""
        return self._card

    @property
    def is_due(self) -> bool:
        """Whether the figure is to be drawn: it has changed, and is on or near the screen."""
        has_room = min(self.visibility.room) > 0
        is_old = self._needs_drawing or self._shown_selected != self._selected
        return self.visibility.is_near and has_room and is_old

    @property
    def is_drawn(self) -> bool:
        """Whether the figure has been drawn, so that it follows its data in place."""
        return self._drawn is not None

    def take_row(self) -> None:
        """Take a whole row of the grid."""
        self.take_columns("1 / -1", least_width=0)

    def take_columns(self, which: str = "span 2", *, least_width: int = 1200) -> None:
        """Take columns of the grid in a window of at least this width; the last call counts."""
        rule = f"@media (width >= {least_width}px) {{ :host {{ grid-column: {which}; }} }}"
        self._card.stylesheets = [*self._card.stylesheets, rule]

    def change(self, theme: str) -> None:
        """Mark the figure as changed, and set the theme for the next drawing."""
        self._theme, self._is_changed = theme, True
        self._tools.theme = self._save.theme = theme
        # A figure on the screen is drawn at once; to fade it for so short a time would flicker.
        if not self.visibility.is_near:
            self._fade()

    def show_selected(self, ids: SelectedIds) -> None:
        """Show what is selected when the figure is drawn next."""
        self._selected = ids

    def draw(self) -> None:
        """Draw the figure from the current data, with what is selected."""
        if self._save not in self._card:
            # A page opens sooner without them.
            self._card.extend([self._save, self._tools])
        if self._needs_drawing or self._drawn is None:
            self._draw()
        if self.is_pending:
            return
        self._shown_selected = self._selected
        self._actions.show(self._selected)

    def mark_stale(self, is_stale: bool) -> None:
        """Mark the figure as stale while a new solution is being computed."""
        self._is_stale = is_stale
        self._tools.is_stale = is_stale and self._figure is not None
        self._fade()

    @property
    def _needs_drawing(self) -> bool:
        return self._is_changed or self._shown_room != self.visibility.room

    def _draw(self) -> None:
        self._shown_room = list(self.visibility.room)
        try:
            if self._is_changed and not self._plot():
                return
            if self._figure is None:
                waiting = self._waiting
                self._show_text(waiting() if callable(waiting) else waiting)
            else:
                self._show(self._figure)
        except (InputError, ValueError, KeyError, TypeError, ArithmeticError) as error:
            # One figure that cannot be drawn must not break the page.
            _LOG.exception("%s cannot be drawn", self.card_name)
            self._figure = None
            self._tools.summary = f"This figure cannot be drawn: {error}"
            self._show_text(f"{self._tools.summary}. {_WHAT_TO_DO}")

    def _text_tables(self) -> list[TextTable]:
        return [] if self._figure is None else text_tables(self._figure)

    def _plot(self) -> bool:
        """Take the current figure; return whether there is one, or a reason why there is none.

        Until then the figure stays due, so that it is asked for again.
        """
        self.is_pending = self._is_changed = False
        figure = self._plot_figure()
        if not isinstance(figure, Pending):
            self._figure = figure
            self._tools.summary = figure_summary(figure) if figure else ""
            return True
        self.is_pending = self._is_changed = True
        self._fade()
        return False

    def _on_screen(self) -> FigureOnScreen | None:
        """Return the figure as it is on the screen, with the limits that a person has chosen."""
        if self._figure is None or self._drawn is None:
            return None
        return FigureOnScreen(self._drawn.with_limits(self._resized(self._figure)), self._theme)

    def _resized(self, figure: Figure) -> Figure:
        """Return the figure in the size of the card."""
        width, height = (length - 2 * _INSET for length in self._shown_room)
        return resized(figure, width, height, corner=_CORNER)

    def _show(self, figure: Figure) -> None:
        figure = self._resized(figure)
        if self._drawn is None:
            is_packed = has_own_scripts(pn.state.curdoc)
            self._drawn = BokehFigure(figure, self._theme, is_packed=is_packed)
        else:
            self._drawn.follow(figure, self._theme)
        if self._pane is None or self._pane.object is not self._drawn.model:
            self._pane = pn.pane.Bokeh(self._drawn.model, margin=0)
            self._follow_zoom(self._drawn)
        self._actions.follow(self._drawn)
        self._put(self._pane)

    def _follow_zoom(self, drawn: BokehFigure) -> None:
        if self._zoom is not None:
            frame = drawn.frames[0]
            frame.zoom_by_wheel()
            for event in (RangesUpdate, Reset):
                frame.plot.on_event(event, self._take_zoom)

    def _take_zoom(self, event: Event) -> None:
        if self._zoom is not None:
            self._zoom(_limits(event) if isinstance(event, RangesUpdate) else None)

    def _show_text(self, text: str) -> None:
        pane = markup_pane()
        pane.object = paragraph(text, "empty", self._theme)
        self._put(pane)

    def _put(self, body: pn.viewable.Viewable) -> None:
        if list(self._body) != [body]:
            self._body[:] = [body]
        self._fade()

    def _fade(self) -> None:
        self.visibility.is_faded = self._is_changed or self._is_stale


def _limits(event: RangesUpdate) -> tuple[Limits, Limits] | None:
    """Return the limits of both axes; None if the browser has sent something else."""
    ends = (event.x0, event.x1, event.y0, event.y1)
    if not all(isinstance(end, float | int) and math.isfinite(end) for end in ends):
        return None
    x0, x1, y0, y1 = map(float, ends)  # type: ignore[arg-type]
    return (x0, x1), (y0, y1)


def card(content: Part, name: str) -> pmui.Paper:
    """Return a card of a `FigureGrid` that scrolls; `name` is short, for its CSS class."""
    return _card(pn.Column(content, styles=_BODY, margin=0), name=name)


def _card(*contents: Part, name: str, least_heights: Sequence[int] = (0, 0, 0)) -> pmui.Paper:
    """Return a card.

    Parameters
    ----------
    least_heights : on a large screen and in windows narrower than each of `_NARROWER`, screen
        pixels; a smaller one has no effect
    """
    heights = [max(_LEAST_HEIGHT, one) for one in accumulate(least_heights, max)]
    least, *narrow = (f":host {{ min-height: {one}px; }}" for one in heights)
    rules = zip(_NARROWER, narrow, strict=True)
    return pmui.Paper(
        OwnLayout(),
        *contents,
        css_classes=["card", "figure", f"figure-{name}"],
        # A card that begins with its figure would have the width of its contents, which fill it.
        styles={
            "align-self": "stretch",
            "width": "100%",
            "min-width": "0",
            "height": "auto",
        },
        stylesheets=[
            ".paper { height: 100%; }",
            least,
            *(f"@media (width < {width}px) {{ {rule} }}" for width, rule in rules),
        ],
        margin=0,
        sx={"height": "100%", "position": "relative", "zIndex": 0},
        elevation=0,
        variant="outlined",
    )
