"""ExploreView: any column of a solution's tables against any other."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import panel as pn
import panel_material_ui as pmui

from plateviz.dashboard.exploration import NONE, Exploration
from plateviz.dashboard.navigation import Navigation
from plateviz.dashboard.views.figure import FigureView
from plateviz.dashboard.views.figure_grid import FigureGrid
from plateviz.dashboard.views.point_actions import PointActions
from plateviz.dashboard.views.workspace import workspace
from plateviz.figures.figure import Figure, Limits
from plateviz.plots.explore import explored_figure, kept_rows
from plateviz.plots.style import ROW_LIMIT
from plateviz.tables.explore import EXPLORABLE, ExplorableTable, sources_within
from solver.data.result import FitResult

_STEPS = 200
_BETWEEN = "between"
_DRAWN = ["x", "y", "colour", "only", "lowest", "highest", "limits"]
_SWITCHES = {"is_log_x": "log x", "is_log_y": "log y", "has_median": "median"}


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
        self._offered: list[str] = []
        self._is_offering = self._is_following = False
        self._figure = FigureView(
            _Text(),
            self._plot,
            waiting="The first solution is being computed.",
            actions=PointActions(
                select=self._session.select_sources, select_area=self._select_area
            ),
            zoom=self._zoom,
            theme=self._session.theme,
        )
        self.grid = FigureGrid([self._figure], wake, columns=1)
        self._limits = pmui.EditableRangeSlider(
            label=_BETWEEN, start=0.0, end=1.0, size="small", width=260, disabled=True
        )
        self._limits.param.watch(self._take_limits, "value_throttled")
        self._workspace = workspace(self.grid, self._controls())
        exploration = self._exploration
        exploration.param.watch(self._show_limits, "only")
        exploration.param.watch(self._change, ["table", *_DRAWN, *_SWITCHES])
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
                for name, label in _SWITCHES.items()
            ),
            sx={"alignItems": "center"},
            sizing_mode="stretch_width",
            margin=0,
        )

    @property
    def _table(self) -> ExplorableTable | None:
        """The table of the solution on the screen; made once."""
        shown, name = self._session.shown, self._exploration.table
        if shown is None:
            return None
        if self._known is None or self._known[0] is not shown.result or self._known[1] != name:
            self._known = (shown.result, name, EXPLORABLE[name](shown.result))
        return self._known[2]

    def _plot(self) -> Figure | None:
        table = self._table
        if table is None:
            return None
        self._offer(list(table.columns))
        selected = self._session.selection.sources
        return explored_figure(table, self._exploration.columns(), selected=selected)

    def _offer(self, columns: list[str]) -> None:
        """Offer the columns of a table before it is drawn."""
        if columns != self._offered:
            self._offered = columns
            self._is_offering = True
            try:
                self._exploration.offer(columns)
            finally:
                self._is_offering = False

    def _change(self, *_: object) -> None:
        if not self._is_offering:
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
        if table is not None:
            kept = kept_rows(table, chosen)
            self._session.select_sources(sources_within(table, chosen.x, chosen.y, corners, kept))

    def _show_limits(self, *_: object) -> None:
        """Let the slider span the values of the column that limits the rows."""
        table, exploration = self._table, self._exploration
        if table is None or exploration.only == NONE:
            self._limits.param.update(label=_BETWEEN, disabled=True)
            return
        values = table.numbers(exploration.only)
        values = values[np.isfinite(values)]
        low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
        high = high if high > low else low + 1.0
        between = _within(exploration, low, high)
        self._is_following = True
        self._limits.param.update(
            label=f"{exploration.only} between",
            start=low,
            end=high,
            step=(high - low) / _STEPS,
            value=between,
            disabled=False,
        )
        self._is_following = False

    def _take_limits(self, event: Any) -> None:  # noqa: ANN401 as param
        if self._is_following or event.new is None:
            return
        # The ends of the slider are all values: what it shows of them is rounded.
        low, high = event.new
        self._exploration.param.update(
            lowest=low if low > self._limits.start else -math.inf,
            highest=high if high < self._limits.end else math.inf,
        )


def _within(exploration: Exploration, low: float, high: float) -> tuple[float, float]:
    return max(low, exploration.lowest), min(high, exploration.highest)
