"""SurveyPage: the orbits of a run and the quality of their fits, and figures of the survey."""

from collections.abc import Callable
from concurrent.futures import Future
from functools import partial

import pandas as pd
import panel as pn
import panel_material_ui as pmui
from astropy.table import Table

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.navigation.rows_to_explore import RunRows
from plateviz.dashboard.saving.downloads import described
from plateviz.dashboard.session.drawn_area import DrawnArea
from plateviz.dashboard.session.latest_answer import PENDING, Pending
from plateviz.dashboard.views.cards.explore import ExploreView
from plateviz.dashboard.views.cards.figure import FigureView, card
from plateviz.dashboard.views.cards.figure_grid import FigureGrid
from plateviz.dashboard.views.cards.point_actions import PointActions
from plateviz.dashboard.views.cards.workspace import below_lines, workspace
from plateviz.dashboard.views.controls.run_selector import run_selector
from plateviz.dashboard.views.controls.unit_selector import unit_selector
from plateviz.dashboard.views.dialogs.code_dialog import code_button
from plateviz.dashboard.views.elements.markup import (
    heading,
    judged,
    markup_pane,
    paragraph,
    themed,
    titled,
)
from plateviz.dashboard.views.elements.stack import Stack
from plateviz.dashboard.views.elements.table import DataTable
from plateviz.dashboard.views.pages.unread_run import STAYS, unread_run
from plateviz.dashboard.views.panes.compare_runs import CompareRunsView
from plateviz.dashboard.views.panes.notable_source import NotableSourceLink
from plateviz.dashboard.views.saving.save_button import SaveButton
from plateviz.dashboard.views.saving.save_choices import Saved, table_choices
from plateviz.figures.figure import Figure
from plateviz.plots.comparison.both_runs import BOTH_RUNS
from plateviz.plots.gallery import survey_figures
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.reports.summary_strip import strip
from plateviz.solving.run_reader import ReadRun
from plateviz.tables import orbit_list, orbit_states, run_strip
from plateviz.tables.headings import ORBITS_OF_RUN
from solver.data.subset import KINDS
from solver.data.survey_schema import MOTIONS, RUN_ORBITS
from solver.errors import InputError

# As high as the headline of a verdict, so that nothing moves when this comes.
_BEING_READ = "<p class='verdict judging'>This run is being read and judged.</p>"
_NO_OTHER = "No other run has been read."
_COLUMNS = {SurveyWorkspace.VERDICT: 1, SurveyWorkspace.CATALOGUE: 3}


class SurveyPage(pn.viewable.Viewer):
    """The Survey view: the run on the screen.

    The reasons of its verdict are open in the Verdict workspace: elsewhere the figures have the
    room.
    """

    def __init__(
        self, navigation: Navigation, wake: Callable[..., object], **params: object
    ) -> None:
        """Follow the run of `navigation`.

        Parameters
        ----------
        wake : called when a figure may have become due to be drawn
        """
        super().__init__(**params)
        self._navigation, self._wake = navigation, wake
        self._session = navigation.session
        self._grids: dict[SurveyWorkspace, FigureGrid] = {}
        self._shown: ReadRun | None = None
        self._being_read: Future[ReadRun] | None = None
        self._failure = ""
        self._compare: CompareRunsView | None = None
        self._head, self._strip = markup_pane(), markup_pane()
        self._table = DataTable(ORBITS_OF_RUN, self._open_row, page_size=8)
        self._save = SaveButton(
            "Orbits and motions", table_choices(self._subject, self._run_tables)
        )
        self._stack = Stack({one: partial(self._workspace, one) for one in SurveyWorkspace})
        self._below = pmui.Column(self._stack, sizing_mode="stretch_width", margin=0)
        self._column = pmui.Column(self._head, self._below, sizing_mode="stretch_width", margin=0)
        self.sidebar = pmui.Column(
            heading("Shown"),
            *run_selector(navigation),
            unit_selector(self._session),
            *code_button(navigation),
            sizing_mode="stretch_width",
            margin=0,
        )
        navigation.param.watch(self._read, ["run_name", "run_progress"])
        navigation.param.watch(self._show_head, ["growth", "survey_workspace"])
        navigation.param.watch(self._show_workspace, "survey_workspace")
        self._session.param.watch(self._show, "theme")
        self._session.units.param.watch(self._show, "unit")
        self._session.selection.param.watch(self._show_selected, [*KINDS])
        self._show_workspace()
        self._read()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the page without its sidebar."""
        return self._column

    @property
    def figures(self) -> FigureGrid:
        """The figures of the workspace on the screen."""
        return self._grids[self._navigation.survey_workspace]

    @property
    def is_pending(self) -> bool:
        """Whether another thread reads and judges the run, or the one that it is compared with."""
        is_other_read = self._compare is not None and self._compare.is_pending
        return self._being_read is not None or is_other_read

    def look(self) -> None:
        """Show the run once it is read; called again and again until then."""
        if self._compare is not None:
            self._compare.look()
        read = self._being_read
        if read is not None and read.done():
            self._take(read)
            self._show()

    def _workspace(self, one: SurveyWorkspace) -> pn.viewable.Viewable:
        if one is SurveyWorkspace.EXPLORE:
            links = {"orbit_id": self._open_orbit}
            explore = ExploreView(
                RunRows(self._navigation),
                self._session,
                self._wake,
                "This run has no rows yet.",
                links,
            )
            self._grids[one] = explore.grid
            self._show_selected()
            return explore.__panel__()
        is_first = one is SurveyWorkspace.VERDICT
        figures = [f for f in survey_figures() if f.workspace is one]
        if one is SurveyWorkspace.COMPARE:
            return self._compare_runs(figures)
        views = [self._figure_view(f) for f in figures]
        columns = _COLUMNS.get(one, 2)
        grid = FigureGrid(views, self._wake, columns=columns)
        for view, figure in zip(views, figures, strict=True):
            if figure.takes_row:
                view.take_row()
            elif columns > 2 and figure.is_wide:
                view.take_columns()
        self._grids[one] = grid
        self._show_selected()
        if not is_first:
            return workspace(grid)
        above = [self._strip, NotableSourceLink(self._navigation)]
        # The health of all orbits is seen at a glance, without scrolling; the table is long.
        return workspace(grid, *above, below=[self._table, self._save])

    def _compare_runs(self, figures: list[SurveyFigure]) -> pn.viewable.Viewable:
        views = [self._figure_view(one) for one in (BOTH_RUNS, *figures)]
        compare = self._compare = CompareRunsView(self._navigation, self._change_compared)
        others = [card(compare, "run-changes")]
        grid = FigureGrid(views, self._wake, columns=3, others=others)
        self._grids[SurveyWorkspace.COMPARE] = grid
        views[0].take_row()
        for view in views[1:]:
            view.take_columns()
        self._show_selected()
        compare.follow(self._shown)
        return compare.unless_alone(workspace(grid))

    def _change_compared(self) -> None:
        grid = self._grids.get(SurveyWorkspace.COMPARE)
        if grid is not None:
            grid.change(self._session.theme)
            self._wake()

    def _subject(self) -> str:
        return f"run-{self._navigation.run_name}"

    def _run_tables(self) -> dict[str, Table]:
        if self._shown is None:
            return {}
        orbits, motions = self._shown.tables[:2]
        tables = {"orbits": described(orbits, RUN_ORBITS)}
        if len(motions):
            tables["motions"] = described(motions, MOTIONS)
        return tables

    def _figure_view(self, figure: SurveyFigure) -> FigureView:
        session = self._session
        return FigureView(
            figure,
            partial(self._plot, figure),
            actions=PointActions(
                {"orbit_id": self._open_orbit},
                session.selection.select_sources,
                area=DrawnArea(session),
            ),
            saved=Saved(self._subject),
            theme=session.theme,
            waiting=_NO_OTHER if figure.workspace is SurveyWorkspace.COMPARE else "",
        )

    def _plot(self, figure: SurveyFigure) -> Figure | Pending | None:
        if self._navigation.run is None:
            return None
        if self._being_read is not None or self._shown is None:
            return PENDING
        # The tables of the figures take longer, and are read when the first figure is drawn.
        tables = self._shown.whole(self._session.store.background)
        if not tables.done():
            return PENDING
        if figure.workspace is SurveyWorkspace.COMPARE and self._compare is not None:
            return self._compare.plot(figure, tables.result())
        return self._session.units.figure(figure.plot(tables.result()))

    def _take(self, read: Future[ReadRun]) -> None:
        self._being_read = None
        try:
            self._shown = read.result()
        except InputError as error:
            self._failure = unread_run(error)

    def _read(self, *_: object) -> None:
        run, store = self._navigation.run, self._session.store
        before = self._shown, self._failure
        self._failure, self._being_read = "", None
        if run is not None:
            try:
                self._being_read = store.run_reader.read(run)
            except InputError as error:
                self._failure = unread_run(error)
        if run is not None and self._shown is not None and self._shown.run.name != run.name:
            self._shown = None
        if self._being_read is not None and self._being_read.done():
            self._take(self._being_read)
        # A run that is turned to is asked for as often as what it has is looked at.
        is_new = (self._shown, self._failure) != before or self._being_read is not None
        if is_new or run is None:
            self._show()

    def _show(self, *_: object) -> None:
        theme, words = self._session.theme, self._navigation.why_no_run
        if self._shown is None:
            # Nothing was read before that could stay.
            words = words or self._failure
        self._save.theme = theme
        self._below.visible = not words
        if words:
            self._head.object = paragraph(words, "empty", theme)
            return
        self._show_head()
        if self._compare is not None:
            self._compare.follow(self._shown)
        if self._shown is None:
            self._strip.object = ""
        else:
            orbits, motions = self._shown.tables[:2]
            items = self._session.units.text(strip(run_strip(orbits, motions)))
            self._strip.object = themed(items, theme)
            self._table.show(orbit_list(orbits), theme, orbit_states(orbits))
        for grid in self._grids.values():
            grid.change(theme)

    def _show_head(self, *_: object) -> None:
        if self._navigation.run is None or not self._below.visible:
            return
        is_compared = self._navigation.survey_workspace is SurveyWorkspace.COMPARE
        title = titled("(B) Run" if is_compared else "Run", self._navigation.run_name)
        verdict = _BEING_READ
        is_open = self._navigation.survey_workspace is SurveyWorkspace.VERDICT
        if self._shown is not None:
            verdict = self._session.units.text(judged(self._shown.verdict, is_open=is_open))
        head = f"<div class='head'>{verdict}{title}</div>"
        self._below.styles = below_lines(bool(self._failure) + bool(self._navigation.growth))
        if self._failure:
            head += paragraph(f"{self._failure} {STAYS}", "outdated", self._session.theme)
        if self._navigation.growth:
            head += paragraph(self._navigation.growth, "caption", self._session.theme)
        self._head.object = themed(head, self._session.theme)

    def _show_selected(self, *_: object) -> None:
        for grid in self._grids.values():
            grid.show_selected(self._session.selection.ids)

    def _show_workspace(self, *_: object) -> None:
        self._stack.show(self._navigation.survey_workspace)

    def _open_row(self, row: pd.Series) -> None:
        self._open_orbit(str(row["orbit_id"]))

    def _open_orbit(self, orbit: str) -> None:
        self._navigation.open_orbit(int(orbit))
