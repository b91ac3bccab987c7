"""ExploreView: any column of a solution's tables against any other."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import panel as pn
import panel_material_ui as pmui
from astropy.table import Table

from plateviz.dashboard.downloads import rows_of
from plateviz.dashboard.exploration import NONE, SWITCHES
from plateviz.dashboard.navigation import Navigation
from plateviz.dashboard.views.figure import FigureView
from plateviz.dashboard.views.figure_grid import FigureGrid
from plateviz.dashboard.views.point_actions import PointActions
from plateviz.dashboard.views.save_choices import Saved
from plateviz.dashboard.views.state_text import missing_text
from plateviz.dashboard.views.workspace import workspace
from plateviz.figures.figure import Figure, Limits
from plateviz.plots.explore import explored_figure, kept_rows
from plateviz.plots.style import ROW_LIMIT
from plateviz.tables.explore import EXPLORABLE, ExplorableTable, sources_within
from solver.data.result import FitResult

_STEPS = 200
# Columns that say what a saved row is of, besides the id of its source.
_KEYS = ("field_id", "plate_id", "detector_id")
_BETWEEN = "between"


class _Text(NamedTuple):
    """What the card says; see `FigureText`."""

    name: str = "explore"
    title: str = "Any column against any other"
    caption: str = (
        "The columns that the controls name, one point per row; above 20,000 rows, the number of "
        "rows in each cell, or the mean of the column that gives the colour. Along both axes their "
        "histograms. A drag selects the sources in a box, which all other figures show. The wheel "
        "zooms, and the cells become finer."
    )
    is_wide: bool = True
    equation: str = ""
    document: str = "assets/docs/diagnostics.md, “Reading the page”"


class ExploreView(pn.viewable.Viewer):
    """Controls for the columns, and the figure."""

    def __init__(
        self, navigation: Navigation, wake: Callable[..., object], **params: object
    ) -> None:
        """Follow the session of `navigation`.

        Parameters
        ----------
        wake : called when the figure may have become due to be drawn
        """
        super().__init__(**params)
        self._session, self._exploration = navigation.session, navigation.exploration
        self._wake = wake
        self._known: tuple[FitResult, str, ExplorableTable] | None = None
        self._is_following = False
        self._figure = FigureView(
            _Text(),
            self._plot,
            waiting=partial(missing_text, self._session),
            actions=PointActions(
                select=self._session.select_sources,
                select_area=self._select_area,
                select_exposures=self._session.select_exposures,
            ),
            zoom=self._zoom,
            saved=Saved(self._session.subject, self._rows),
            theme=self._session.theme,
        )
        self.grid = FigureGrid([self._figure], wake, columns=1)
        self._limits = pmui.EditableRangeSlider(
            label=_BETWEEN, start=0.0, end=1.0, size="small", width=260, disabled=True
        )
        self._limits.param.watch(self._take_limits, "value_throttled")
        self._workspace = workspace(self.grid, self._controls())
        names = list(self._exploration.param.values())
        self._exploration.param.watch(self._show_limits, ["only", "lowest", "highest"])
        self._exploration.param.watch(self._change, names)
        self._session.selection.param.watch(self._show_selected, "sources")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the workspace."""
        return self._workspace

    def _controls(self) -> pmui.FlexBox:
        parameters = self._exploration.param
        select = partial(pmui.Select.from_param, size="small", description="", margin=(4, 6))
        return pmui.FlexBox(
            select(parameters.table, label="Rows", width=150),
            select(parameters.y, label="y", width=210),
            select(parameters.x, label="x", width=210),
            select(parameters.colour, label="Colour", width=210),
            select(parameters.only, label="Limit by", width=210),
            self._limits,
            *(
                pmui.Checkbox.from_param(
                    parameters[name], label=label, description="", margin=(4, 6)
                )
                for name, label in SWITCHES.items()
            ),
            sx={"alignItems": "center"},
            sizing_mode="stretch_width",
            margin=0,
        )

    @property
    def _table(self) -> ExplorableTable | None:
        """The table of the solution on the screen; made once, with the controls for it."""
        shown, name = self._session.shown, self._exploration.table
        if shown is None:
            return None
        if self._known is None or self._known[0] is not shown.result or self._known[1] != name:
            table = EXPLORABLE[name](shown.result)
            self._known = (shown.result, name, table)
            with self._following():
                self._exploration.offer(list(table.columns))
            self._show_limits()
        return self._known[2]

    @contextmanager
    def _following(self) -> Iterator[None]:
        """Change controls without an answer to that."""
        self._is_following = True
        try:
            yield
        finally:
            self._is_following = False

    def _plot(self) -> Figure | None:
        table = self._table
        if table is None:
            return None
        selected = self._session.selection.sources
        return explored_figure(table, self._exploration.columns(), selected=selected)

    def _rows(self) -> dict[str, Table]:
        """Return the rows between the limits, with the columns that are drawn and those of keys."""
        table, chosen = self._table, self._exploration.columns()
        if table is None:
            return {}
        drawn = filter(None, (chosen.x, chosen.y, chosen.colour, chosen.only))
        names = dict.fromkeys((*(name for name in _KEYS if name in table.columns), *drawn))
        return {table.rows: rows_of(table, kept_rows(table, chosen), names)}

    def _change(self, *_: object) -> None:
        if not self._is_following:
            self._figure.change(self._session.theme)
            self._wake()

    def _show_selected(self, *_: object) -> None:
        """Mark the selected sources among cells; points are marked by themselves."""
        if self._known is not None and self._known[2].size > ROW_LIMIT:
            self._change()

    def _zoom(self, limits: tuple[Limits, Limits] | None) -> None:
        self._exploration.limits = limits

    def _select_area(self, corners: np.ndarray) -> None:
        table, chosen = self._table, self._exploration.columns()
        # An exposure has all sources, so that an area of exposures selects none.
        if table is not None and table.has_sources:
            kept = kept_rows(table, chosen)
            self._session.select_sources(sources_within(table, chosen.x, chosen.y, corners, kept))

    def _show_limits(self, *_: object) -> None:
        """Let the slider span the values of the column that limits the rows."""
        known, exploration = self._known, self._exploration
        if self._is_following:
            return
        if known is None or exploration.only == NONE:
            self._limits.param.update(label=_BETWEEN, disabled=True)
            return
        values = known[2].numbers(exploration.only)
        values = values[np.isfinite(values)]
        low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
        high = high if high > low else low + 1.0
        with self._following():
            self._limits.param.update(
                label=f"{exploration.only} between",
                start=low,
                end=high,
                step=(high - low) / _STEPS,
                value=(max(low, exploration.lowest), min(high, exploration.highest)),
                disabled=False,
            )

    def _take_limits(self, event: Any) -> None:  # noqa: ANN401 as param
        if self._is_following or event.new is None:
            return
        # The ends of the slider are all values: what it shows of them is rounded.
        low, high = event.new
        self._exploration.param.update(
            lowest=low if low > self._limits.start else -math.inf,
            highest=high if high < self._limits.end else math.inf,
        )
