"""SelectionBar: what is selected, and what can be done with it."""

from collections.abc import Callable

import numpy as np
import panel as pn
import panel_material_ui as pmui
from astropy.table import Table

from plateviz.dashboard.downloads import described, rows_of
from plateviz.dashboard.navigation import Navigation, View
from plateviz.dashboard.selected import KINDS, Selected
from plateviz.dashboard.selection_actions import SelectionActions
from plateviz.dashboard.views.kept_selections import KeptSelections
from plateviz.dashboard.views.save_button import SaveButton
from plateviz.dashboard.views.save_choices import table_choices
from plateviz.dashboard.views.selection_list import SelectionList
from plateviz.tables.explore import (
    explorable_exposures,
    explorable_measurements,
    explorable_sources,
)
from solver.data.survey_schema import MOTIONS

_IN_THE_BAR = {"color": "inherit", "textTransform": "none", "whiteSpace": "nowrap", "minWidth": 0}


class SelectionBar(pn.viewable.Viewer):
    """A line of words and buttons; empty while nothing is selected and nothing kept.

    Attributes
    ----------
    windows : place of the windows; elsewhere on the page, since a window has the colours of what
        it is in
    """

    def __init__(self, navigation: Navigation, **params: object) -> None:
        """Follow the selection of the session of `navigation`."""
        super().__init__(**params)
        self._navigation, self._session = navigation, navigation.session
        self._actions = SelectionActions(navigation.session)
        self._row = pmui.Row(margin=0, sx={"alignItems": "center"})
        self.windows = pmui.Column(margin=0)
        self._parts: list[pn.viewable.Viewable] = []
        self._session.selection.param.watch(self._show, [*KINDS, "kept"])
        self._session.choices.param.watch(self._show, "exclusions")
        self._session.param.watch(self._show, ["shown", "theme"])
        navigation.param.watch(self._show, "view")
        self._show()

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the line."""
        return self._row

    def _make(self) -> None:
        actions = self._actions
        self._words = pmui.Typography("", variant="body2", margin=(0, 8), sx=_IN_THE_BAR)
        self._list, self._kept = SelectionList(self._navigation), KeptSelections(self._navigation)
        self._open = self._button("Open", self._open_source)
        self._leave_out = self._button("Leave out of the fit", actions.leave_out)
        self._put_back = self._button("Put back into the fit", actions.put_back)
        self._save = SaveButton(
            "selection", table_choices(self._subject, self._tables), place="bar"
        )
        self._invert = self._button("Invert", actions.invert)
        self._keep = self._button("Keep", self._kept.open)
        self._parts = [
            self._words,
            self._button("List", self._list.open),
            self._open,
            self._leave_out,
            self._put_back,
            self._invert,
            self._save,
            self._keep,
            self._button("Clear", actions.clear),
        ]
        self.windows[:] = [self._list, self._kept]

    def _button(self, label: str, act: Callable[[], None]) -> pmui.Button:
        button = pmui.Button(
            label=label, variant="text", size="small", margin=(0, 2), sx=_IN_THE_BAR
        )
        button.on_click(lambda _: act())
        return button

    def _show(self, *_: object) -> None:
        session, selected = self._session, self._session.selection.selected
        if not selected and not session.selection.kept:
            self._row.clear()
            return
        if not self._parts:
            self._make()
        is_orbit, is_left_out = self._is_of_orbit, self._actions.is_left_out
        in_orbit = self._actions.in_orbit if is_orbit else None
        self._words.object = words(selected, in_orbit)
        is_source = selected.kinds == ["sources"] and len(selected.sources) == 1
        self._open.visible = is_source and self._navigation.run is not None
        self._leave_out.visible = is_orbit and not is_left_out
        self._put_back.visible = is_orbit and is_left_out
        self._invert.visible = is_orbit
        self._keep.label = "Keep" if selected else "Kept selections"
        self._save.theme = session.theme
        self._list.show()
        shown = self._parts if selected else [self._keep]
        if list(self._row) != shown:
            self._row[:] = shown

    def _open_source(self) -> None:
        (source,) = self._session.selection.sources
        self._navigation.open_source(str(source))

    @property
    def _is_of_orbit(self) -> bool:
        return self._navigation.view is View.ORBIT and self._session.shown is not None

    def _subject(self) -> str:
        of = (
            self._session.selection.subject()
            if self._is_of_orbit
            else f"run-{self._navigation.run_name}"
        )
        return f"{of}-selection"

    def _tables(self) -> dict[str, Table]:
        """Return what is selected and its measurements, or the motions of sources in the run."""
        shown, run = self._session.shown, self._navigation.run
        selected = self._session.selection.selected
        if self._is_of_orbit and shown is not None:
            result = shown.result
            sources, exposures = explorable_sources(result), explorable_exposures(result)
            is_selected = np.isin(sources.read("source_id"), list(selected.sources))
            tables = {
                "sources": rows_of(sources, is_selected),
                "exposures": rows_of(exposures, selected.chosen(result.exposures)),
                "measurements": rows_of(
                    explorable_measurements(result), selected.chosen(result.residuals)
                ),
            }
            return {name: table for name, table in tables.items() if len(table)}
        if run is None:
            return {}
        rows = run.motions() if run.is_gathered else run.counts()
        return {"sources": described(rows[rows["source_id"].isin(selected.sources)], MOTIONS)}


def words(selected: Selected, in_orbit: Selected | None) -> str:
    """Return the selection in words.

    Parameters
    ----------
    selected : the selection
    in_orbit : the part that the orbit on the screen has measured; None if no orbit is shown
    """
    text = f"{selected.words()} selected"
    if in_orbit is None or in_orbit == selected:
        return text
    return (
        f"{text}, {in_orbit.words()} in this orbit" if in_orbit else f"{text}, none in this orbit"
    )
