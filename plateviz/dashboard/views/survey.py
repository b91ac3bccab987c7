"""SurveyPage: the orbits of a run and the quality of their fits, and figures of the survey."""

from collections.abc import Callable
from functools import partial

import pandas as pd
import panel as pn
import panel_material_ui as pmui
from astropy.table import Table

from plateviz.dashboard.downloads import described
from plateviz.dashboard.navigation import Navigation
from plateviz.dashboard.row_origins import RunRows
from plateviz.dashboard.selected import KINDS
from plateviz.dashboard.views.code_window import code_button
from plateviz.dashboard.views.explore import ExploreView
from plateviz.dashboard.views.figure import FigureView
from plateviz.dashboard.views.figure_grid import FigureGrid
from plateviz.dashboard.views.markup import (
    heading,
    judged,
    markup_pane,
    paragraph,
    themed,
    titled,
)
from plateviz.dashboard.views.notable_source import NotableSourceLink
from plateviz.dashboard.views.point_actions import PointActions
from plateviz.dashboard.views.run_selector import run_selector
from plateviz.dashboard.views.save_button import SaveButton
from plateviz.dashboard.views.save_choices import Saved, table_choices
from plateviz.dashboard.views.stack import Stack
from plateviz.dashboard.views.table import DataTable
from plateviz.dashboard.views.unit_selector import unit_selector
from plateviz.dashboard.views.workspace import workspace
from plateviz.figures.figure import Figure
from plateviz.plots.gallery import survey_figures
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.reports.summary_strip import strip
from plateviz.runs.load_tables import survey_tables
from plateviz.runs.run_tests import read_run_tests
from plateviz.tables import orbit_list, orbit_states, run_strip
from plateviz.tables.headings import ORBITS_OF_RUN
from plateviz.tables.run_verdict import run_verdict
from plateviz.tables.survey_tables import SurveyTables
from plateviz.tables.verdict import Verdict
from solver.data.survey_schema import MOTIONS, RUN_ORBITS
from solver.errors import InputError

_WHAT_TO_DO = "What was read before stays. Reload the page once the run is there again."


class SurveyPage(pn.viewable.Viewer):
    """The Survey view: the run on the screen."""

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
        self._tables: SurveyTables | None = None
        self._orbits = self._motions = pd.DataFrame()
        self._verdict: Verdict | None = None
        self._failure = ""
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
        navigation.param.watch(self._read, ["run_name", "written"])
        navigation.param.watch(self._show_head, "growth")
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
        views = [self._figure_view(f) for f in survey_figures() if f.workspace is one]
        grid = FigureGrid(views, self._wake, columns=1 if is_first else 2)
        self._grids[one] = grid
        self._show_selected()
        if not is_first:
            return workspace(grid)
        above = [self._strip, NotableSourceLink(self._navigation)]
        # The health of all orbits is seen at a glance, without scrolling; the table is long.
        return workspace(grid, *above, below=[self._table, self._save])

    def _subject(self) -> str:
        return f"run-{self._navigation.run_name}"

    def _run_tables(self) -> dict[str, Table]:
        tables = {"orbits": described(self._orbits, RUN_ORBITS)}
        if len(self._motions):
            tables["motions"] = described(self._motions, MOTIONS)
        return tables

    def _figure_view(self, figure: SurveyFigure) -> FigureView:
        session = self._session
        return FigureView(
            figure,
            partial(self._plot, figure),
            actions=PointActions({"orbit_id": self._open_orbit}, session.selection.select_sources),
            saved=Saved(self._subject),
            theme=session.theme,
        )

    def _plot(self, figure: SurveyFigure) -> Figure | None:
        run = self._navigation.run
        if run is None:
            return None
        if self._tables is None:
            self._tables = survey_tables(run)
        return self._session.units.figure(figure.plot(self._tables))

    def _read(self, *_: object) -> None:
        # The tables of the figures take longer, and are read when the first figure is drawn.
        self._tables = None
        run = self._navigation.run
        self._failure = ""
        if run is not None:
            try:
                orbits, motions, tests = run.orbits(), run.motions(), read_run_tests(run)
                self._orbits, self._motions = orbits, motions
                self._verdict = run_verdict(orbits, motions, tests)
            except InputError as error:
                self._failure = f"The run cannot be read: {error}. {_WHAT_TO_DO}"
        self._show()

    def _show(self, *_: object) -> None:
        theme, words = self._session.theme, self._navigation.why_no_run
        if self._orbits.empty:
            # Nothing was read before that could stay.
            words = words or self._failure
        self._save.theme = theme
        self._below.visible = not words
        if words:
            self._head.object = paragraph(words, "empty", theme)
            return
        self._show_head()
        items = self._session.units.text(strip(run_strip(self._orbits, self._motions)))
        self._strip.object = themed(items, theme)
        self._table.show(orbit_list(self._orbits), theme, orbit_states(self._orbits))
        for grid in self._grids.values():
            grid.change(theme)

    def _show_head(self, *_: object) -> None:
        if self._navigation.run is None or self._verdict is None:
            return
        title = titled("Run", self._navigation.run_name)
        verdict = self._session.units.text(judged(self._verdict))
        head = f"<div class='head'>{verdict}{title}</div>"
        if self._failure:
            head += paragraph(self._failure, "outdated", self._session.theme)
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
