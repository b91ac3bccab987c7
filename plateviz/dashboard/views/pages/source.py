"""SourcePage: one source of a run through all its orbits."""

from collections.abc import Callable
from functools import partial

import pandas as pd
import panel as pn
import panel_material_ui as pmui
from astropy.table import Table

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.navigation.source_in_orbit import open_source_in_orbit
from plateviz.dashboard.saving.downloads import described
from plateviz.dashboard.views.cards.figure import FigureView
from plateviz.dashboard.views.cards.figure_grid import FigureGrid
from plateviz.dashboard.views.cards.point_actions import PointActions
from plateviz.dashboard.views.cards.workspace import workspace
from plateviz.dashboard.views.controls.run_selector import run_selector
from plateviz.dashboard.views.controls.unit_selector import unit_selector
from plateviz.dashboard.views.dialogs.code_dialog import code_button
from plateviz.dashboard.views.elements.markup import (
    heading,
    judged,
    markup_pane,
    numbers,
    paragraph,
    themed,
    titled,
)
from plateviz.dashboard.views.elements.stack import Stack
from plateviz.dashboard.views.elements.table import DataTable
from plateviz.dashboard.views.pages.unread_run import RELOAD, unread_run
from plateviz.dashboard.views.panes.notable_source import NotableSourceLink
from plateviz.dashboard.views.panes.run_remark import RunRemark
from plateviz.dashboard.views.saving.save_button import SaveButton
from plateviz.dashboard.views.saving.save_choices import Saved, table_choices
from plateviz.figures.figure import Figure
from plateviz.plots.gallery import source_figures
from plateviz.plots.survey_figure import SourceFigure
from plateviz.plots.workspace import SourceWorkspace
from plateviz.reports.summary_strip import strip
from plateviz.tables import (
    motion_in_words,
    motion_table,
    source_class,
    source_list,
    source_orbits,
    source_strip,
)
from plateviz.tables.headings import ORBITS_OF_SOURCE, SOURCES_OF_RUN
from plateviz.tables.survey_tables import SourceTables
from plateviz.verdict.verdict import source_verdict
from solver.data.survey_schema import HISTORY, MOTIONS
from solver.errors import InputError

_INVITATION = (
    "Write a source's id on the left, choose one below, or tap its point in a figure of the "
    "Survey or the Orbit view and open it."
)
_MEASUREMENTS = (
    "A click on an orbit opens it with this source selected, on the residual map of the exposure "
    "and detector that measured it first. So does a tap on the point of an orbit in the figures."
)
_NO_SOURCES = "No orbit of this run is fitted yet. Its sources are listed here once one is."
_NO_RUN = "The sources cannot be listed: the run is not on the disk any more."


class SourcePage(pn.viewable.Viewer):
    """The Source view: the source that was found, or the list of all sources."""

    def __init__(
        self, navigation: Navigation, wake: Callable[..., object], **params: object
    ) -> None:
        """Follow the source of `navigation`.

        Parameters
        ----------
        wake : called when a figure may have become due to be drawn
        """
        super().__init__(**params)
        self._navigation, self._session = navigation, navigation.session
        self._invitation = _INVITATION
        self._tables: SourceTables | None = None
        self._are_numbers_old = True
        self._head, self._strip, self._motion = markup_pane(), markup_pane(), markup_pane()
        self._measurements, self._remark = markup_pane(), RunRemark(navigation)
        self._orbits = DataTable(ORBITS_OF_SOURCE, self._open_row, units=self._session.units)
        self._save = SaveButton(
            "Orbits and motion", table_choices(self._subject, self._source_tables)
        )
        self._list = DataTable(SOURCES_OF_RUN, self._open_source, page_size=20)
        self.figures = FigureGrid([self._figure_view(f) for f in source_figures()], wake)
        self._stack = Stack(
            {
                SourceWorkspace.MOTION: lambda: workspace(self.figures, self._strip),
                SourceWorkspace.ORBITS: self._numbers,
            }
        )
        self._rest = pmui.Column(self._stack, sizing_mode="stretch_width", margin=0)
        self._choice = pmui.Column(
            NotableSourceLink(navigation), self._list, sizing_mode="stretch_width"
        )
        self._column = pmui.Column(
            self._head, self._remark, self._rest, self._choice, sizing_mode="stretch_width"
        )
        self._entry = pmui.TextInput(
            label="Source id",
            size="small",
            sizing_mode="stretch_width",
            disabled=not navigation.run,
        )
        self.sidebar = pmui.Column(
            heading("Shown"),
            *run_selector(navigation),
            self._entry,
            unit_selector(self._session),
            *code_button(navigation),
            sizing_mode="stretch_width",
            margin=0,
        )
        self._watch()
        self._show_workspace()
        self._list_sources()
        self._show()

    def _watch(self) -> None:
        """Follow what a person enters, the navigation and the session."""
        navigation = self._navigation
        self._entry.param.watch(lambda event: navigation.find_source(event.new), "value")
        navigation.param.watch(self._list_sources, ["run_name", "run_progress"])
        navigation.param.watch(self._show, ["run_name", "run_progress", "found", "message"])
        navigation.param.watch(self._show_workspace, "source_workspace")
        self._session.param.watch(self._show, "theme")
        self._session.units.param.watch(self._show, "unit")
        navigation.param.watch(self._allow_entry, "run_name")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the page without its sidebar."""
        return self._column

    @property
    def is_pending(self) -> bool:
        """Whether another thread reads and judges the run."""
        return self._remark.is_pending

    def look(self) -> None:
        """Say how good the run is once it is judged; called again and again until then."""
        self._remark.look()

    def _allow_entry(self, *_: object) -> None:
        self._entry.disabled = self._navigation.run is None

    def _numbers(self) -> pn.viewable.Viewable:
        return pmui.Column(
            heading("Motion"),
            self._motion,
            heading("Orbits"),
            self._measurements,
            self._orbits,
            self._save,
            sizing_mode="stretch_width",
        )

    def _subject(self) -> str:
        found = self._navigation.found
        return "" if found is None else f"source-{found.source_id}"

    def _source_tables(self) -> dict[str, Table]:
        found = self._navigation.found
        if found is None:
            return {}
        tables = {"orbits": described(found.history, HISTORY)}
        if found.motion is not None:
            tables["motion"] = described(found.motion.to_frame().T.infer_objects(), MOTIONS)
        return tables

    def _figure_view(self, figure: SourceFigure) -> FigureView:
        return FigureView(
            figure,
            partial(self._plot, figure),
            actions=PointActions({"orbit_id": self._open_orbit}),
            saved=Saved(self._subject),
            theme=self._session.theme,
        )

    def _show_workspace(self, *_: object) -> None:
        self._show_numbers()
        self._stack.show(self._navigation.source_workspace)

    def _plot(self, figure: SourceFigure) -> Figure | None:
        found = self._navigation.found
        if found is None:
            return None
        if self._tables is None or self._tables.history is not found.history:
            self._tables = SourceTables(found.history, found.motion)
        return self._session.units.figure(figure.plot(self._tables))

    def _list_sources(self, *_: object) -> None:
        run = self._navigation.run
        if run is not None:
            try:
                sources = source_list(run.counts())
            except InputError as error:
                self._invitation = unread_run(error)
                self._list.show(pd.DataFrame(columns=list(SOURCES_OF_RUN)))
                return
            self._invitation = _INVITATION
            if sources.empty:
                # A run that has been removed has none, as one that has just begun.
                self._invitation = _NO_SOURCES if run.is_there() else f"{_NO_RUN} {RELOAD}"
            self._list.show(sources)

    def _show(self, *_: object) -> None:
        # All of it is sent as one message.
        with pn.io.hold():
            self._show_source()

    def _show_source(self) -> None:
        theme, found = self._session.theme, self._navigation.found
        units = self._session.units
        self._save.theme = theme
        self._rest.visible = found is not None
        self._choice.visible = found is None and self._navigation.run is not None
        if found is None:
            words = self._navigation.why_no_run or self._navigation.message or self._invitation
            self._head.object = paragraph(words, "empty", theme)
            return
        self._entry.value = str(found.source_id)
        kind = source_class(found.history)
        title = titled(f"{kind.capitalize()} source", str(found.source_id))
        verdict = units.text(judged(source_verdict(found.history, found.motion)))
        self._head.object = themed(f"<div class='head'>{verdict}{title}</div>", theme)
        items = units.text(strip(source_strip(found.history, found.motion)))
        self._strip.object = themed(items, theme)
        self._are_numbers_old = True
        self._show_numbers()
        self.figures.change(theme)

    def _show_numbers(self) -> None:
        """Fill the tables of the workspace on the screen, which are read less often than others."""
        found, theme = self._navigation.found, self._session.theme
        is_shown = self._navigation.source_workspace is SourceWorkspace.ORBITS
        if found is None or not (self._are_numbers_old and is_shown):
            return
        self._are_numbers_old = False
        if found.motion is None:
            words = "Motions are fitted once all orbits of the run are fitted."
            self._motion.object = paragraph(words, "caption", theme)
        else:
            table = self._session.units.rows(motion_table(found.history, found.motion))
            self._motion.object = themed(numbers(motion_in_words(table)), theme)
        self._measurements.object = paragraph(_MEASUREMENTS, "caption", theme)
        self._orbits.show(source_orbits(found.history), theme)

    def _open_row(self, row: pd.Series) -> None:
        self._open_orbit(str(row["orbit_id"]))

    def _open_orbit(self, orbit: str) -> None:
        found = self._navigation.found
        if found is not None:
            open_source_in_orbit(self._navigation, found.source_id, int(orbit))

    def _open_source(self, row: pd.Series) -> None:
        self._navigation.find_source(str(row["id"]))
