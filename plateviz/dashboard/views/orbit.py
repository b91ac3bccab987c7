"""OrbitPage: one solution of one orbit, with its figures, tables and refits."""

from functools import partial

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation import Navigation
from plateviz.dashboard.session import Stage
from plateviz.dashboard.views.calibration import CalibrationView
from plateviz.dashboard.views.figure import FigureGrid, FigureView
from plateviz.dashboard.views.markup import heading
from plateviz.dashboard.views.refit import RefitView
from plateviz.dashboard.views.selection import SelectionView
from plateviz.dashboard.views.summary import SummaryView
from plateviz.figures.figure import Figure
from plateviz.plots.diagnostic import Chosen, Diagnostic
from plateviz.plots.gallery import diagnostics


class OrbitPage(pn.viewable.Viewer):
    """The Orbit view: the solution on the screen, updated when it changes."""

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the session of `navigation`."""
        super().__init__(**params)
        self._session = session = navigation.session
        views = {d: self._figure_view(d, navigation) for d in diagnostics()}
        self._selected = [view for d, view in views.items() if d.follows_selection]
        self.figures = FigureGrid(list(views.values()))
        self.sidebar = pmui.Column(
            heading("Shown"),
            SelectionView(navigation),
            heading("Refit"),
            RefitView(session),
            sizing_mode="stretch_width",
            margin=0,
        )
        self._column = pmui.Column(
            SummaryView(session),
            self.figures,
            heading("Calibration"),
            CalibrationView(session),
            sizing_mode="stretch_width",
        )
        session.param.watch(self._change, ["shown", "other", "theme"])
        session.param.watch(self._mark_stale, ["stage"])
        session.selection.param.watch(self._change_selected, ["field", "plates", "detector"])
        self._change()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the page without its sidebar."""
        return self._column

    def _figure_view(self, diagnostic: Diagnostic, navigation: Navigation) -> FigureView:
        return FigureView(
            diagnostic,
            partial(self._plot, diagnostic),
            waiting="The first solution is being computed.",
            links={"id": navigation.open_source} if navigation.run else {},
        )

    def _plot(self, diagnostic: Diagnostic) -> Figure | None:
        session, shown = self._session, self._session.shown
        if shown is None:
            return None
        chosen = Chosen(
            result=shown.result,
            instrument=session.store.instrument,
            exposures=tuple(session.selection.exposures_of(shown.result)),
            detector=session.selection.detector_id,
            other=session.other.result if session.other else None,
        )
        return diagnostic.plot(chosen)

    def _change(self, *_: object) -> None:
        self.figures.change(self._session.theme)

    def _change_selected(self, *_: object) -> None:
        for view in self._selected:
            view.change(self._session.theme)

    def _mark_stale(self, *_: object) -> None:
        self.figures.mark_stale(self._session.stage is Stage.STALE)
