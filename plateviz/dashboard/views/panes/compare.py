"""CompareView: what the solution is compared with, and what differs between the two."""

from collections.abc import Callable

import pandas as pd
import panel as pn
import panel_material_ui as pmui
from astropy.table import Table

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.navigation.solution_list import Entry, SolutionList, by_label, label_of
from plateviz.dashboard.saving.changes_file import changes_file
from plateviz.dashboard.views.elements.markup import markup_pane, numbers, paragraph, themed
from plateviz.dashboard.views.saving.save_button import SaveButton
from plateviz.dashboard.views.saving.save_choices import table_choices
from plateviz.plots.comparison.both_solutions import comparable_figures
from plateviz.plots.diagnostic import TO_COMPARE, Diagnostic
from plateviz.tables.headings import CHANGES, in_words
from plateviz.verdict.solution_changes import solution_changes
from solver.errors import InputError

_BEFORE = "the solution before it"


class CompareView(pn.viewable.Viewer):
    """Two choosers, of the other solution and of the figure that is drawn of both, and a table."""

    def __init__(
        self, navigation: Navigation, change_figure: Callable[[], object], **params: object
    ) -> None:
        """Follow the session of `navigation`.

        Parameters
        ----------
        change_figure : called when another figure is to be drawn of both
        """
        super().__init__(**params)
        self._navigation, self._session = navigation, navigation.session
        self._list = SolutionList(navigation)
        wide = {"sizing_mode": "stretch_width", "size": "small"}
        self._other = pmui.Select(
            label="Compare with (A)",
            options=[_BEFORE],
            value=_BEFORE,
            margin=(12, 10, 5, 10),
            **wide,
        )
        self._figures = {one.name: one for one in comparable_figures()}
        figures = {one.title: name for name, one in self._figures.items()}
        chosen = self._session.figure_of_both
        self._figure = pmui.Select(label="Figure of both", options=figures, value=chosen, **wide)
        self._figure.link(self._session, value="figure_of_both", bidirectional=True)
        self._figure.param.watch(lambda _: change_figure(), "value")
        self._table, self._changes = markup_pane(), pd.DataFrame()
        self._save = SaveButton("changes", table_choices(self._subject, self._files))
        self._message = ""
        self._column = pn.Column(
            self._other, self._figure, self._save, self._table, sizing_mode="stretch_width"
        )
        self._entries: dict[str, Entry] = {}
        self._is_offering = False
        self._other.param.watch(self._choose, "value")
        self._session.param.watch(self._fill, ["shown", "other", "theme"])
        self._session.judging.param.watch(self._fill, "is_any_pending")
        self._session.units.param.watch(self._fill, "unit")
        self._session.param.watch(self._offer, ["shown", "other"])
        self._session.journal.param.watch(self._offer, "made")
        navigation.param.watch(self._offer, ["run_name", "orbit_workspace"])
        self._offer()
        self._fill()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the choosers and the table."""
        return self._column

    @property
    def figure(self) -> Diagnostic:
        """The figure that is drawn of both solutions."""
        return self._figures[self._session.figure_of_both]

    def _offer(self, *_: object) -> None:
        entries = [*self._list.entries(), *self._list.other_orbits()]
        self._entries = by_label(entries)
        self._is_offering = True
        try:
            chosen = self._session.chosen_other
            label = None if chosen is None else label_of(chosen, self._entries)
            self._other.param.update(options=[_BEFORE, *self._entries], value=label or _BEFORE)
        finally:
            self._is_offering = False

    def _choose(self, *_: object) -> None:
        if self._is_offering:
            return
        entry = self._entries.get(str(self._other.value))
        self._message = ""
        try:
            found = None if entry is None else self._list.to_compare_with(entry)
            self._session.compare_with(found)
        except InputError as error:
            self._message = str(error)
        self._fill()

    def _subject(self) -> str:
        return f"{self._session.shown_part.subject()}-changes"

    def _files(self) -> dict[str, Table]:
        return changes_file(self._session.units.changes(self._changes))

    def _fill(self, *_: object) -> None:
        session, self._changes = self._session, pd.DataFrame()
        self._save.theme = session.theme
        self._show_changes()
        self._save.visible = not self._changes.empty

    def _show_changes(self) -> None:
        session = self._session
        shown, other = session.shown, session.other
        if self._message or shown is None or other is None:
            text = self._message or f"What differs between (A) and (B), in numbers. {TO_COMPARE}"
            self._table.object = paragraph(text, "empty", session.theme)
            return
        if session.judging.is_any_pending:
            self._table.object = paragraph(
                "The solutions are being judged.", "empty", session.theme
            )
            return
        self._changes = solution_changes(other.result, shown.result)
        table = in_words(session.units.changes(self._changes), CHANGES)
        self._table.object = themed(numbers(table, "changes"), session.theme)
