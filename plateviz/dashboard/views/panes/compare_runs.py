"""CompareRunsView: the other run of a survey, and what differs between it and the one shown."""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace

import pandas as pd
import panel as pn
import panel_material_ui as pmui
from astropy.table import Table

from plateviz.dashboard.navigation.growth import how_to_make_another_run
from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.saving.changes_file import changes_file
from plateviz.dashboard.session.latest_answer import PENDING, Pending
from plateviz.dashboard.views.elements.markup import markup_pane, numbers, paragraph, themed
from plateviz.dashboard.views.saving.save_button import SaveButton
from plateviz.dashboard.views.saving.save_choices import table_choices
from plateviz.figures.figure import Figure
from plateviz.plots.comparison.both_runs import (
    BOTH_RUNS,
    comparable_survey_figures,
    figure_of_both_runs,
)
from plateviz.plots.survey_figure import SurveyFigure
from plateviz.plots.workspace import SurveyWorkspace
from plateviz.runs.load_tables import require_same_catalogue
from plateviz.solving.run_reader import ReadRun
from plateviz.tables.counts import orbits_text
from plateviz.tables.headings import CHANGES, in_words
from plateviz.tables.run_health import COMPLETE
from plateviz.tables.survey_tables import SurveyTables
from plateviz.verdict.run_changes import run_changes
from solver.errors import InputError

_BEING_READ = "The other run is being read."


class CompareRunsView(pn.viewable.Viewer):
    """Two choosers, of the other run (A) and of the figure that is drawn of both, and a table.

    The other run is read once the workspace is on the screen.
    """

    def __init__(
        self, navigation: Navigation, change: Callable[[], object], **params: object
    ) -> None:
        """Compare with the run of `navigation` (B), once `follow` has told what it has.

        Parameters
        ----------
        change : called when another figure, or another run, is to be drawn
        """
        super().__init__(**params)
        self._navigation, self._session = navigation, navigation.session
        self._comparison, self._change = self._session.run_comparison, change
        self._shown: ReadRun | None = None
        self._being_read: Future[ReadRun] | None = None
        self._failure, self._changes = "", pd.DataFrame()
        self._compared: tuple[ReadRun, ReadRun] | None = None
        self._other: ReadRun | None = None
        self._figures = {one.name: one for one in comparable_survey_figures()}
        wide = {"sizing_mode": "stretch_width", "size": "small"}
        self._run = pmui.Select(label="Compare with run (A)", margin=(12, 10, 5, 10), **wide)
        self._figure = pmui.Select(
            label="Figure of both",
            options={one.title: name for name, one in self._figures.items()},
            value=self._comparison.figure,
            **wide,
        )
        self._table = markup_pane()
        self._save = SaveButton("changes", table_choices(self._subject, self._files))
        self._column = pn.Column(
            self._run, self._figure, self._save, self._table, sizing_mode="stretch_width"
        )
        self._alone = markup_pane()
        self._is_offering = False
        self._figure.link(self._comparison, value="figure", bidirectional=True)
        self._run.param.watch(self._choose, "value")
        self._comparison.param.watch(lambda _: change(), "figure")
        self._comparison.param.watch(self._read, ["other", "state"])
        navigation.param.watch(self._read, ["view", "survey_workspace", "run_name", "run_progress"])
        navigation.param.watch(self._read, "run_name", what="objects")
        self._session.param.watch(self._fill, "theme")
        self._session.units.param.watch(self._fill, "unit")
        self._read()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the choosers and the table."""
        return self._column

    @property
    def is_pending(self) -> bool:
        """Whether another thread reads the other run."""
        return self._being_read is not None

    @property
    def _is_on_screen(self) -> bool:
        return self._navigation.workspace is SurveyWorkspace.COMPARE

    def unless_alone(self, cards: pmui.FlexBox) -> pn.viewable.Viewable:
        """Return the cards of the workspace, in whose place stands what to do without them."""

        def show(*_: object) -> None:
            cards.visible = not self._alone.visible

        show()
        self._alone.param.watch(show, "visible")
        return pmui.Column(self._alone, cards, sizing_mode="stretch_width", margin=0)

    def plot(self, figure: SurveyFigure, tables: SurveyTables) -> Figure | Pending | None:
        """Return a figure of both runs, or None while there is no other one.

        Parameters
        ----------
        tables : of the run on the screen
        """
        if self.is_pending:
            return PENDING
        if self._other is None:
            return None
        other = self._other.whole(self._session.store.background)
        if not other.done():
            return PENDING
        both = replace(tables, other=other.result())
        if figure is BOTH_RUNS:
            chosen = self._figures[self._comparison.figure]
            return self._session.units.figure(figure_of_both_runs(chosen, both))
        return self._session.units.figure(figure.plot(both))

    def follow(self, shown: ReadRun | None) -> None:
        """Compare with a run as it was read; None while it is read."""
        self._shown = shown
        self._fill()

    def look(self) -> None:
        """Take the other run once it is read; called again and again until then."""
        read = self._being_read
        if read is None or not read.done():
            return
        before, self._being_read = self._other, None
        try:
            self._other = read.result()
        except InputError as error:
            self._fail(error)
        self._fill()
        if self._other is not before:
            self._change()

    def _read(self, *_: object) -> None:
        navigation = self._navigation
        if not self._is_on_screen:
            return
        run = self._comparison.run(navigation.run_name, navigation.known_runs)
        self._offer(None if run is None else run.name)
        before, self._failure = self._other, ""
        self._being_read = None
        if run is None or (before is not None and before.run.name != run.name):
            self._other = None
        try:
            if run is not None and navigation.run is not None:
                require_same_catalogue(run, navigation.run)
                self._being_read = self._session.store.run_reader.read(run)
        except InputError as error:
            self._fail(error)
        if self._being_read is not None and self._being_read.done():
            self.look()
        else:
            self._fill()
            self._change()

    def _fail(self, error: InputError) -> None:
        self._other, self._failure = None, f"The runs cannot be compared: {error}."

    def _offer(self, chosen: str | None) -> None:
        others = [one for one in self._navigation.known_runs if one != self._navigation.run_name]
        self._is_offering = True
        try:
            self._run.param.update(options=others, value=chosen)
        finally:
            self._is_offering = False

    def _choose(self, *_: object) -> None:
        if not self._is_offering and self._run.value is not None:
            self._comparison.other = str(self._run.value)

    def _subject(self) -> str:
        other = "" if self._other is None else self._other.run.name
        return f"run-{self._navigation.run_name}-against-{other}"

    def _files(self) -> dict[str, Table]:
        return changes_file(self._session.units.changes(self._changes))

    def _fill(self, *_: object) -> None:
        if not self._is_on_screen:
            return
        session, navigation = self._session, self._navigation
        self._save.theme = session.theme
        words = ""
        if not self._run.options and navigation.run_name is not None:
            origin = session.store.origin
            causes = () if self._shown is None else self._shown.verdict.causes
            options = next((one.options for one in causes if one.options), ())
            words = how_to_make_another_run(origin, navigation.run_name, options)
        self._alone.object = paragraph(words, "empty", session.theme) if words else ""
        self._alone.visible = bool(words)
        self._show_changes()
        self._save.visible = not self._changes.empty

    def _show_changes(self) -> None:
        a, b = self._other, self._shown
        words = self._failure or _BEING_READ
        # In the middle of an exchange, both are the same run.
        if self._being_read is None and a and b and a.run.name != b.run.name:
            words = self._compare(a, b)
        else:
            self._compared, self._changes = None, pd.DataFrame()
        theme = self._session.theme
        if self._changes.empty:
            self._table.object = paragraph(words, "empty", theme)
            return
        changes = in_words(self._session.units.changes(self._changes), CHANGES)
        table = themed(numbers(changes, "changes"), theme)
        self._table.object = (paragraph(words, "caption", theme) if words else "") + table

    def _compare(self, a: ReadRun, b: ReadRun) -> str:
        """Take what differs between two runs, once; return what is to be said of it."""
        if self._compared != (a, b):
            self._compared, self._changes = (a, b), run_changes(a.compared, b.compared)
        return " ".join(_growth(one) for one in (a, b) if one.tables.motions.empty)


def _growth(read: ReadRun) -> str:
    orbits = read.tables.orbits
    fitted = int((orbits["status"] == COMPLETE).sum())
    return (
        f"Run {read.run.name} has {fitted:,} of {orbits_text(len(orbits))} so far; its motions are "
        "fitted after the last one."
    )
