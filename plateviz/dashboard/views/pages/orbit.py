"""OrbitPage: one solution of one orbit, with its figures, tables and refits."""

from collections.abc import Callable
from functools import partial

import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.navigation.rows_to_explore import OrbitRows
from plateviz.dashboard.session.latest_answer import PENDING, Pending
from plateviz.dashboard.session.orbit_figures import chosen_of, figure_of, figures_of
from plateviz.dashboard.session.shown_address import SHOWN
from plateviz.dashboard.session.stage import Stage
from plateviz.dashboard.views.cards.explore import ExploreView
from plateviz.dashboard.views.cards.figure import FigureView, Part, card
from plateviz.dashboard.views.cards.figure_grid import FigureGrid
from plateviz.dashboard.views.cards.point_actions import session_actions
from plateviz.dashboard.views.cards.state_text import empty_text
from plateviz.dashboard.views.cards.workspace import workspace
from plateviz.dashboard.views.controls.refit import RefitView
from plateviz.dashboard.views.controls.shown_part import ShownPartView
from plateviz.dashboard.views.controls.unit_selector import unit_selector
from plateviz.dashboard.views.elements.markup import heading
from plateviz.dashboard.views.elements.stack import Stack
from plateviz.dashboard.views.panes.calibration import CalibrationView
from plateviz.dashboard.views.panes.compare import CompareView
from plateviz.dashboard.views.panes.remedies import RemediesView
from plateviz.dashboard.views.panes.summary import HeadView, StripView
from plateviz.dashboard.views.saving.save_choices import Saved
from plateviz.figures.figure import Figure
from plateviz.plots.comparison.both_solutions import BOTH, figure_of_both
from plateviz.plots.diagnostic import Diagnostic
from plateviz.plots.workspace import OrbitWorkspace
from plateviz.runs.scratch_result import are_eigenmodes_to_come, request_eigenmodes
from solver.data.subset import KINDS


class OrbitPage(pn.viewable.Viewer):
    """The Orbit view: the solution on the screen, updated when it changes."""

    def __init__(
        self, navigation: Navigation, wake: Callable[..., object], **params: object
    ) -> None:
        """Follow the session of `navigation`.

        Parameters
        ----------
        wake : called when a figure may have become due to be drawn
        """
        super().__init__(**params)
        self._navigation, self._wake = navigation, wake
        self._session = session = navigation.session
        self._grids: dict[OrbitWorkspace, FigureGrid] = {}
        self._following: list[FigureView] = []
        self._compare: CompareView | None = None
        self._controls = [self._shown_controls, self._refit_controls]
        self._stack = Stack({one: partial(self._workspace, one) for one in OrbitWorkspace})
        self.sidebar = pmui.Column(sizing_mode="stretch_width", margin=0)
        self._column = pmui.Column(
            HeadView(navigation), self._stack, sizing_mode="stretch_width", margin=0
        )
        session.param.watch(self._change, ["shown", "other", "theme"])
        session.param.watch(self._mark_stale, ["stage"])
        session.units.param.watch(self._change, "unit")
        session.selection.param.watch(self._show_selected, [*KINDS])
        session.shown_part.param.watch(self._change_shown, [*SHOWN])
        navigation.param.watch(self._show_workspace, "orbit_workspace")
        self._show_workspace()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the page without its sidebar."""
        return self._column

    def complete(self, is_fitting: bool) -> bool:
        """Make the controls that are not there yet, first those of what is shown.

        They are many, and the figures do not wait for them. Before the browser has laid the page
        out, it may lose what is added.

        Parameters
        ----------
        is_fitting : whether a fit has just begun, for which the controls of a refit wait

        Returns
        -------
        whether some were made
        """
        if not self._controls or not self.figures.is_laid_out:
            return False
        if is_fitting and len(self._controls) == 1:
            return False
        self.sidebar.extend(self._controls.pop(0)())
        return True

    def _shown_controls(self) -> list[Part]:
        part, units = ShownPartView(self._navigation), unit_selector(self._session)
        return [heading("Shown"), part, units]

    def _refit_controls(self) -> list[Part]:
        return [heading("Refit"), RefitView(self._navigation)]

    @property
    def figures(self) -> FigureGrid:
        """The figures of the workspace on the screen."""
        return self._grids[self._navigation.orbit_workspace]

    def _workspace(self, one: OrbitWorkspace) -> pn.viewable.Viewable:
        if one is OrbitWorkspace.EXPLORE:
            explore = ExploreView(
                OrbitRows(self._navigation),
                self._session,
                self._wake,
                partial(empty_text, self._session),
            )
            self._grids[one] = explore.grid
            return explore.__panel__()
        is_first = one is OrbitWorkspace.VERDICT
        views = {d: self._figure_view(d) for d in figures_of(self._session, one)}
        first, others, above = [], [], []
        if one is OrbitWorkspace.ORDERS:
            views = {BOTH: self._figure_view(BOTH), **views}
            self._compare = CompareView(self._navigation, lambda: self._change_figure(views[BOTH]))
            # What two solutions differ in, and which two, before the pictures of it.
            first = [card(self._compare, "changes")]
        if one is OrbitWorkspace.CALIBRATION:
            others = [card(CalibrationView(self._session), "tables")]
        self._following += [view for d, view in views.items() if d.follows_shown]
        if is_first:
            above = [RemediesView(self._session), StripView(self._session)]
        # Six square cards fill a large screen in two rows.
        are_six = one is OrbitWorkspace.CALIBRATION and len(views) + len(others) == 6
        grid = FigureGrid(
            list(views.values()),
            self._wake,
            columns=3 if is_first else 2,
            columns_if_wide=3 if are_six else None,
            first=first,
            others=others,
        )
        self._grids[one] = grid
        self._show_selected()
        return workspace(grid, *above)

    def _figure_view(self, diagnostic: Diagnostic) -> FigureView:
        return FigureView(
            diagnostic,
            partial(self._plot, diagnostic),
            waiting=partial(empty_text, self._session),
            actions=session_actions(self._session),
            saved=Saved(self._session.shown_part.subject),
            theme=self._session.theme,
        )

    def _plot(self, diagnostic: Diagnostic) -> Figure | Pending | None:
        of_both = self._compare.figure if diagnostic is BOTH and self._compare else None
        if self._is_pending(diagnostic if of_both is None else of_both, of_both is not None):
            return PENDING
        chosen = chosen_of(self._session)
        if chosen is None:
            return None
        figure = figure_of_both(of_both, chosen) if of_both else figure_of(diagnostic, chosen)
        return self._session.units.figure(figure)

    def _is_pending(self, diagnostic: Diagnostic, is_of_both: bool) -> bool:
        """Whether a part that a figure needs of its solution, or of both, is still being made.

        Nobody else requests eigenmodes: they are made for the figures that need them.
        """
        session = self._session
        judging = session.judging
        if diagnostic.needs_verdict and (
            judging.is_any_pending if is_of_both else judging.is_pending
        ):
            return True
        if not diagnostic.needs_eigenmodes:
            return False
        drawn = (session.shown, session.other) if is_of_both else (session.shown,)
        results = [one.result for one in drawn if one is not None]
        for result in results:
            request_eigenmodes(result)
        return any(map(are_eigenmodes_to_come, results))

    def _show_workspace(self, *_: object) -> None:
        self._stack.show(self._navigation.orbit_workspace)

    def _change(self, *_: object) -> None:
        for grid in self._grids.values():
            grid.change(self._session.theme)

    def _change_figure(self, view: FigureView) -> None:
        view.change(self._session.theme)
        self._wake()

    def _change_shown(self, *_: object) -> None:
        for view in self._following:
            view.change(self._session.theme)

    def _show_selected(self, *_: object) -> None:
        for grid in self._grids.values():
            grid.show_selected(self._session.selection.ids)

    def _mark_stale(self, *_: object) -> None:
        with pn.io.hold():
            for grid in self._grids.values():
                grid.mark_stale(self._session.stage is Stage.STALE)
        if self._session.shown is None:
            # What is said instead of the figures depends on the stage.
            self._change()
