"""FigureView: one diagnostic on the screen, with its caption and the state it is in."""

import logging

import panel as pn
import panel_material_ui as pmui

from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.session import Session, Solution, Stage
from plateviz.views.markup import markup_pane, paragraph
from solver.errors import InputError

_BATCH = 4
_LOG = logging.getLogger(__name__)


class FigureView(pn.viewable.Viewer):
    """A card with one diagnostic; due to be drawn when what it is drawn from changes."""

    def __init__(self, session: Session, diagnostic: Diagnostic, **params: object) -> None:
        """Follow `session`, and its selection where the diagnostic depends on it."""
        super().__init__(**params)
        self._session, self._diagnostic = session, diagnostic
        self.is_due = False
        self._caption = markup_pane()
        self._figure = pn.Column(sizing_mode="stretch_width", margin=0)
        self._card = pmui.Paper(
            self._caption,
            self._figure,
            css_classes=["figure", f"figure-{diagnostic.name}"],
            styles={
                "flex": "1 1 100%" if diagnostic.is_wide else "1 1 520px",
                "min-width": "0",
                "align-self": "stretch",
                "height": "auto",
            },
            stylesheets=[".paper { height: 100%; }"],
            margin=6,
            sx={"height": "100%"},
            elevation=0,
            variant="outlined",
        )
        session.param.watch(self._change, ["shown", "other", "theme"])
        session.param.watch(self._mark_stale, ["stage"])
        if diagnostic.follows_selection:
            session.selection.param.watch(self._change, ["field", "plates", "detector"])
        self._change()
        self._say("The first solution is being made.")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the card."""
        return self._card

    def draw(self) -> None:
        """Draw the figure from the session as it is now."""
        self.is_due = False
        shown = self._session.shown
        if shown is None:
            return
        try:
            self._figure[:] = [self._picture(shown)]
        except (InputError, ValueError, KeyError, TypeError, ArithmeticError) as error:
            # One figure that cannot be drawn must not take the page with it.
            _LOG.exception("%s cannot be drawn", self._diagnostic.name)
            self._say(f"This figure cannot be drawn: {error}")

    def _change(self, *_: object) -> None:
        self.is_due = True
        caption = self._diagnostic.caption
        self._caption.object = paragraph(caption, "caption", self._session.theme)

    def _picture(self, shown: Solution) -> pn.viewable.Viewable:
        session = self._session
        chosen = Chosen(
            result=shown.result,
            instrument=session.workbench.instrument,
            exposures=tuple(session.selection.exposures_of(shown.result)),
            detector=session.selection.detector_id,
            other=session.other.result if session.other else None,
        )
        element = self._diagnostic.draw(chosen, session.theme)
        return pn.pane.HoloViews(
            element, backend="bokeh", linked_axes=False, align="center", margin=0
        )

    def _mark_stale(self, *_: object) -> None:
        self._figure.styles = {"opacity": "0.45" if self._session.stage is Stage.STALE else "1"}

    def _say(self, words: str) -> None:
        pane = markup_pane()
        pane.object = paragraph(words, "empty", self._session.theme)
        self._figure[:] = [pane]


class FigureGrid(pn.viewable.Viewer):
    """The cards of several diagnostics, two in a row where there is room."""

    def __init__(
        self, session: Session, diagnostics: tuple[Diagnostic, ...], **params: object
    ) -> None:
        """Make a card for each diagnostic, in order."""
        super().__init__(**params)
        self._views = [FigureView(session, diagnostic) for diagnostic in diagnostics]
        self._box = pn.FlexBox(
            *self._views, align_items="stretch", sizing_mode="stretch_width", margin=(8, 0)
        )

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the cards."""
        return self._box

    @property
    def is_due(self) -> bool:
        """Whether some figure is to be drawn."""
        return any(view.is_due for view in self._views)

    def draw_due(self) -> None:
        """Draw the first few figures that are due.

        Drawing takes tenths of a second, and so does each change of the page: in batches,
        the page opens at once, fills from the top, and answers in between.
        """
        due = [view for view in self._views if view.is_due]
        with pn.io.hold():
            for view in due[:_BATCH]:
                view.draw()
