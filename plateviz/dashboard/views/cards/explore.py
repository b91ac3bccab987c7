"""ExploreView: any column of the tables of an orbit or a run against any other."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import panel as pn
import panel_material_ui as pmui
import param
from astropy.table import Table

from plateviz.dashboard.navigation.rows_to_explore import RowsToExplore, TableRequest
from plateviz.dashboard.saving.explored_file import explored_file
from plateviz.dashboard.session.latest_answer import PENDING, LatestAnswer, Pending
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.views.cards.figure import FigureView
from plateviz.dashboard.views.cards.figure_grid import FigureGrid
from plateviz.dashboard.views.cards.point_actions import NO_LINKS, Links, session_actions
from plateviz.dashboard.views.cards.workspace import workspace
from plateviz.dashboard.views.elements.markup import markup_pane, paragraph
from plateviz.dashboard.views.saving.save_choices import Saved
from plateviz.figures.figure import Figure, Limits
from plateviz.plots.elements.style import ROW_LIMIT
from plateviz.plots.explore.explore import explored_figure
from plateviz.plots.explore.explored_rows import (
    DataExtent,
    ExploredColumns,
    extent_of,
    items_within,
)
from plateviz.plots.explore.explored_text import SWITCHES
from plateviz.tables.explore import ExplorableTable
from solver.data.subset import KINDS, Subset
from solver.errors import InputError

MOST_SELECTED = 250_000
"""Sources, exposures or detectors that an area can select."""


class _Text(NamedTuple):
    """What the card says; see `FigureText`."""

    caption: str
    document: str
    name: str = "explore"
    title: str = "Any column against any other"
    is_wide: bool = True
    equation: str = ""
    least_height: int = 0
    narrow_height: int = 0
    column_height: int = 0


class _Drawn(NamedTuple):
    """An answer: the figure, and what it is of."""

    figure: Figure
    table: ExplorableTable
    chosen: ExploredColumns
    extent: DataExtent


class ExploreView(pn.viewable.Viewer):
    """Controls for the columns, and the figure."""

    def __init__(
        self,
        rows: RowsToExplore,
        session: Session,
        wake: Callable[..., object],
        waiting: str | Callable[[], str],
        links: Links = NO_LINKS,
        **params: object,
    ) -> None:
        """Draw columns of `rows`.

        Parameters
        ----------
        session : has the selection and the theme
        wake : called when the figure may have become due to be drawn
        waiting : text while there are no rows, or what returns it
        links : what a tap on a row without a source opens, as in `PointActions`
        """
        super().__init__(**params)
        self._to_explore, self._session, self._wake = rows, session, wake
        self._exploration = rows.exploration
        self._latest: LatestAnswer[_Drawn] = LatestAnswer(rows.executor)
        self._selecting: LatestAnswer[frozenset[Any]] = LatestAnswer(rows.executor)
        self._drawn: _Drawn | None = None
        self._table: object = None
        self._extent: tuple[object, DataExtent] | None = None
        self._area: np.ndarray | None = None
        self._is_following = False
        self._figure = FigureView(
            _Text(rows.caption, rows.document),
            self._plot,
            waiting=waiting,
            actions=session_actions(session, links, self._take_area),
            zoom=self._zoom,
            saved=Saved(rows.subject, self._rows),
            theme=session.theme,
        )
        self.grid = FigureGrid([self._figure], wake, columns=1)
        self._limits = [
            pmui.TextInput(label=label, size="small", width=130, margin=(4, 6), visible=False)
            for label in ("at least", "at most")
        ]
        for entry in self._limits:
            entry.param.watch(self._take_limits, "value")
        self._words = markup_pane()
        self._words.visible = False
        self._workspace = workspace(self.grid, self._controls())
        self._exploration.param.watch(self._change, list(self._exploration.param.values()))
        session.selection.param.watch(self._show_selected, [*KINDS])
        session.units.param.watch(lambda *_: self._redraw(), "unit")

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the workspace."""
        return self._workspace

    def _controls(self) -> pmui.FlexBox:
        parameters = self._exploration.param
        select = partial(pmui.Select.from_param, size="small", description="", margin=(4, 6))
        self._selects = select(parameters.selects, label="A drag selects", width=150, visible=False)
        return pmui.FlexBox(
            select(parameters.table, label="Rows", width=150),
            select(parameters.y, label="y", width=180),
            select(parameters.x, label="x", width=180),
            select(parameters.colour, label="Colour", width=180),
            self._selects,
            select(parameters.only, label="Limit by", width=180),
            *self._limits,
            *(
                pmui.Checkbox.from_param(
                    parameters[name], label=label, description="", margin=(4, 6)
                )
                for name, label in SWITCHES.items()
            ),
            self._words,
            sx={"alignItems": "center"},
            sizing_mode="stretch_width",
            margin=0,
        )

    @contextmanager
    def _following(self) -> Iterator[None]:
        """Change controls without an answer to that."""
        self._is_following = True
        try:
            yield
        finally:
            self._is_following = False

    def _plot(self) -> Figure | Pending | None:
        request = self._to_explore.request()
        if request is None:
            return None
        if request.key != self._table:
            self._table = request.key
            with self._following():
                problems = self._exploration.offer(request.columns)
            if problems:
                self._session.note(problems)
        if not self._select(request):
            return PENDING
        chosen, selected = self._exploration.columns(), self._session.selection.selected
        make = partial(self._make, request, chosen, selected)
        drawn = self._latest.answer((request.key, chosen, selected), make)
        if isinstance(drawn, Pending):
            return drawn
        self._drawn = drawn
        self._show_controls(drawn)
        return self._session.units.figure(drawn.figure)

    def _make(self, request: TableRequest, chosen: ExploredColumns, selected: Subset) -> _Drawn:
        """Make a figure; runs on a thread of its own where that takes a while."""
        table = request.make()
        # Neither a zoom nor another colour changes how many rows there are.
        of_all = replace(chosen, limits=None, colour="", has_median=False, selects="")
        key = (request.key, of_all)
        if self._extent is None or self._extent[0] != key:
            self._extent = (key, extent_of(table, chosen))
        items, extent = selected.by_kind().get(table.kind(chosen.selects)), self._extent[1]
        figure = explored_figure(table, chosen, selected=items or frozenset(), extent=extent)
        return _Drawn(figure, table, chosen, extent)

    def _rows(self) -> dict[str, Table]:
        """Return the rows between the limits, with the columns that are drawn and those of keys."""
        if self._drawn is None:
            return {}
        return explored_file(self._drawn.table, self._exploration.columns())

    def _change(self, *_: object) -> None:
        if not self._is_following:
            self._say("")
            self._redraw()

    def _redraw(self) -> None:
        self._figure.change(self._session.theme)
        self._wake()

    def _show_selected(self, *events: param.parameterized.Event) -> None:
        """Mark what is selected among cells; points are marked by themselves."""
        if (drawn := self._drawn) is not None and drawn.table.size > ROW_LIMIT:
            kind = drawn.table.kind(drawn.chosen.selects)
            if any(event.name == kind for event in events):
                self._redraw()

    def _zoom(self, limits: tuple[Limits, Limits] | None) -> None:
        if limits is not None:
            x, y = self._of_columns(np.array(limits).T).T.tolist()
            limits = tuple(x), tuple(y)
        self._exploration.limits = limits

    def _take_area(self, corners: np.ndarray) -> None:
        if self._drawn is not None and self._drawn.table.kinds:
            self._area = self._of_columns(corners)
            self._redraw()

    def _of_columns(self, places: np.ndarray) -> np.ndarray:
        """Return places in the picture, (n, 2), in the units of the columns."""
        if self._drawn is None:
            return places
        return places / self._session.units.of_axes(self._drawn.figure)

    def _select(self, request: TableRequest) -> bool:
        """Select what is in the area that a person has drawn; return whether that is done."""
        area, drawn = self._area, self._drawn
        if area is None or drawn is None:
            return True
        make = partial(items_within, drawn.table, drawn.chosen, area)
        try:
            key = (request.key, drawn.chosen, area.tobytes())
            found = self._selecting.answer(key, make)
        except InputError as error:
            self._area = None
            self._say(f"Nothing was selected: {error}")
            return True
        if isinstance(found, Pending):
            return False
        self._area = None
        kind = drawn.table.kind(drawn.chosen.selects)
        if not found:
            self._say("No row is in that area. What was selected stays selected.")
        elif len(found) > MOST_SELECTED:
            self._say(
                f"{len(found):,} {kind} have rows in that area, and at most {MOST_SELECTED:,} can "
                "be selected: draw a smaller one, or limit the rows. What was selected stays."
            )
        else:
            self._say("")
            self._session.selection.param.update(**{kind: found})
        return True

    def _say(self, words: str) -> None:
        """Show words above the figure; none hides them."""
        if words or self._words.visible:
            text = paragraph(words, "caption", self._session.theme) if words else ""
            self._words.param.update(object=text, visible=bool(words))

    def _show_controls(self, drawn: _Drawn) -> None:
        """Offer what can be selected, and the limits of the column that limits the rows."""
        self._selects.visible = len(drawn.table.kinds) > 1
        is_limited, limits = bool(drawn.chosen.only), (drawn.chosen.lowest, drawn.chosen.highest)
        with self._following():
            for entry, limit, end in zip(self._limits, limits, drawn.extent.only, strict=True):
                entry.param.update(
                    visible=is_limited,
                    value=f"{limit:.12g}" if math.isfinite(limit) else "",
                    error_state=False,
                    helper_text="",
                    placeholder="" if math.isnan(end) else f"{end:.6g}",
                )

    def _take_limits(self, _: object) -> None:
        if self._is_following:
            return
        lowest, highest = (_number(entry) for entry in self._limits)
        if lowest is not None and highest is not None:
            self._exploration.param.update(
                lowest=-math.inf if math.isnan(lowest) else lowest,
                highest=math.inf if math.isnan(highest) else highest,
            )


def _number(entry: pmui.TextInput) -> float | None:
    """Return the number in a control: NaN if it is empty, None, which it says, if it is none."""
    text = entry.value.strip()
    try:
        number = float(text or "nan")
        is_number = math.isfinite(number) or not text
    except ValueError:
        number, is_number = math.nan, False
    words = "" if is_number else "Expected a number."
    entry.param.update(error_state=not is_number, helper_text=words)
    return number if is_number else None
