"""PointActions: a tap opens an orbit; a tap, box or lasso selects what the points are of."""

import time
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from bokeh import models
from bokeh.events import Event, PanStart, SelectionGeometry

from plateviz.dashboard.selection.selected import NO_IDS, SelectedIds
from plateviz.dashboard.session.drawn_area import DrawnArea
from plateviz.dashboard.session.session import Session
from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.bokeh_frame import BokehFrame
from plateviz.figures.bokeh_glyphs import SELECTED_BY, BokehGlyphs
from plateviz.figures.figure import HANDLES
from plateviz.tables.labels import labelled_exposure
from plateviz.tables.polygon import Polygon

Links = Mapping[str, Callable[[str], object]]
"""Column of a point's data -> function that is called with its value as text."""
Select = Callable[[frozenset[Any]], object]
"""Called with what a person has selected: ids of sources or detectors, or pairs of exposures."""

SelectArea = Callable[[np.ndarray], object]
"""Called with the corners, (n, 2), of an area that a person has drawn where there are no points."""

_MOST_CORNERS = 500
_ONE_TAP_SECONDS = 0.5
NO_LINKS: Links = MappingProxyType({})


class PointActions:
    """What the points of one drawn figure do; the first link whose column they have is followed.

    Points of sources, detectors or exposures are selected instead, if there is a function for that.
    """

    def __init__(
        self,
        links: Links = NO_LINKS,
        select: Select | None = None,
        select_area: SelectArea | None = None,
        *,
        select_exposures: Select | None = None,
        select_detectors: Select | None = None,
        area: DrawnArea | None = None,
    ) -> None:
        """Begin without a figure; `select` is for points of sources.

        Parameters
        ----------
        area : told of each area that a person draws among points
        """
        self._links, self._select_area, self._area = links, select_area, area
        selects = zip(SELECTED_BY, (select, select_exposures, select_detectors), strict=True)
        self._selects = {column: one for column, one in selects if one is not None}
        self._followed: set[str] = set()
        self._heard: set[str] = set()
        self._frames: dict[str, _FrameTools] = {}
        self._selectable: list[list[BokehGlyphs]] = []
        self._selected: SelectedIds = NO_IDS
        self._is_showing = False
        # Stars lie on most outlines. A tap on an outline is not one on the stars below it, which
        # the browser tells next.
        self._outline_until = 0.0

    def follow(self, drawn: BokehFigure) -> None:
        """Make the points of a figure act, those among them that are new."""
        self._selectable = []
        # Frames that the figure no longer has are to be forgotten: their columns take memory.
        plots = {frame.plot.id for frame in drawn.frames}
        self._frames = {plot: tools for plot, tools in self._frames.items() if plot in plots}
        for frame in drawn.frames:
            selectable = [one for one in frame.glyphs() if selected_column(one) is not None]
            self._selectable.append(selectable)
            if frame.plot.id not in self._heard:
                self._heard.add(frame.plot.id)
                self._hear(frame)
            for glyphs in frame.glyphs():
                if glyphs.source.id not in self._followed:
                    self._follow_glyphs(frame, glyphs)

    def _follow_glyphs(self, frame: BokehFrame, glyphs: BokehGlyphs) -> None:
        """Let glyphs select, or open links, or neither."""
        if selected_column(glyphs) in self._selects:
            self._followed.add(glyphs.source.id)
            self._select_from(frame, glyphs)
        elif column := next((c for c in self._links if c in glyphs.source.data), None):
            self._followed.add(glyphs.source.id)
            self._open_on_tap(frame, glyphs, column)

    def _hear(self, frame: BokehFrame) -> None:
        """Answer to the areas that a person draws."""
        if self._select_area is not None:
            self._tools_of(frame).select_anywhere()
        if (area := self._area) is not None:
            frame.plot.on_event(PanStart, lambda _: area.begin())
        if self._select_area is not None or area is not None:
            frame.plot.on_event(SelectionGeometry, lambda event: self._take_area(frame, event))

    def show(self, selected: SelectedIds) -> None:
        """Show what is selected: rows of a selected source, exposure or detector stand out."""
        self._selected = selected
        for frame in self._selectable:
            for glyphs in frame:
                self._show_rows(glyphs)
            # Of two solutions beside each other, the one without what is selected stays readable.
            stand_out = [glyphs for glyphs in frame if glyphs.source.selected.indices]
            for glyphs in frame:
                is_of_kind = any(selected.get(column) for column in glyphs.keys)
                glyphs.fade(bool(stand_out) and is_of_kind and glyphs not in stand_out)

    def _show_rows(self, glyphs: BokehGlyphs) -> None:
        self._is_showing = True
        try:
            rows = sorted(_rows(glyphs, self._selected))
            if glyphs.source.selected.indices != rows:
                glyphs.source.selected.indices = rows
        finally:
            self._is_showing = False

    def _select_from(self, frame: BokehFrame, glyphs: BokehGlyphs) -> None:
        glyphs.source.selected.on_change(
            "indices", lambda _name, _old, rows: self._take_rows(glyphs, rows)
        )
        if glyphs.kind == "points":
            self._tools_of(frame).select_among(glyphs.renderer)
        elif glyphs.renderer.name == HANDLES:
            self._tools_of(frame).tap_among(glyphs.renderer)

    def _take_rows(self, glyphs: BokehGlyphs, rows: list[int]) -> None:
        """Select what a person has chosen in a frame, once some glyphs of it have other `rows`."""
        # The tables of a frame answer one after the other; the last one completes the answer.
        among = next((one for one in self._selectable if glyphs in one), None)
        column = selected_column(glyphs)
        if self._is_showing or among is None or column not in self._selects:
            return
        same = [one for one in among if selected_column(one) == column]
        if glyphs.kind == "points" and time.monotonic() < self._outline_until:
            self._show_rows(glyphs)
            return
        chosen = frozenset(text for one in same for text in self._chosen(one))
        if chosen == self._selected.get(column, frozenset()):
            # Nothing else will show the other rows of what is chosen again.
            self.show(self._selected)
        items = (_item(column, text) for text in chosen)
        self._selects[column](frozenset(item for item in items if item is not None))
        if glyphs.renderer.name == HANDLES and rows:
            self._outline_until = time.monotonic() + _ONE_TAP_SECONDS

    def _chosen(self, glyphs: BokehGlyphs) -> Iterable[str]:
        """Return the ids that a person has chosen among points; other glyphs only follow them."""
        is_chosen_among = glyphs.kind == "points" or glyphs.renderer.name == HANDLES
        if not is_chosen_among or not glyphs.renderer.visible:
            return ()
        column = selected_column(glyphs) or ""
        ids, rows = glyphs.keys[column], set(glyphs.source.selected.indices)
        before = _rows(glyphs, self._selected)
        if before <= rows:
            # Rows are added to those that stand out, some of which may do so for another reason:
            # a measurement of a selected exposure has not been chosen for its source.
            own = {column: self._selected.get(column, frozenset())}
            rows -= before - _rows(glyphs, own)
        # They come from the browser.
        return (str(ids[row]) for row in rows if 0 <= row < len(ids))

    def _take_area(self, frame: BokehFrame, event: Event) -> None:
        if not isinstance(event, SelectionGeometry) or not event.final:
            return
        corners = _corners(event.geometry or {})
        if corners is None:
            return
        selectable = [one for one in frame.glyphs() if selected_column(one) is not None]
        if any(one.kind == "points" and one.renderer.visible for one in selectable):
            # The points have answered before.
            if self._area is not None:
                has_points = self._has_points(selectable, corners)
                self._area.end(has_points)
                if not has_points:
                    # Where the same is selected as before, nothing else will show it again.
                    self.show(self._selected)
        elif self._select_area is not None:
            self._select_area(corners)

    def _has_points(self, selectable: list[BokehGlyphs], corners: np.ndarray) -> bool:
        """Return whether an area has selected points, or has deselected those in it."""
        if any(True for one in selectable for _ in self._chosen(one)):
            return True
        polygon = Polygon(corners)
        points = [one for one in selectable if one.kind == "points" and one.renderer.visible]
        places = [[one.source.data[one.at[axis]] for axis in ("x", "y")] for one in points]
        return any(polygon.contains(*map(np.asarray, place)).any() for place in places)

    def _open_on_tap(self, frame: BokehFrame, glyphs: BokehGlyphs, column: str) -> None:
        source = glyphs.source

        def open_link(name: str, old: list[int], new: list[int]) -> None:
            if new:
                # A tap is not a selection: the other points must not stay faded.
                source.selected.indices = []
                self._links[column](str(source.data[column][new[0]]))

        source.selected.on_change("indices", open_link)
        self._tools_of(frame).tap_among(glyphs.renderer)

    def _tools_of(self, frame: BokehFrame) -> "_FrameTools":
        return self._frames.setdefault(frame.plot.id, _FrameTools(frame.plot))


def session_actions(
    session: Session, links: Links = NO_LINKS, select_area: SelectArea | None = None
) -> PointActions:
    """Return actions that select sources, exposures and detectors in a session."""
    selection = session.selection
    return PointActions(
        links,
        selection.select_sources,
        select_area,
        select_exposures=selection.select_exposures,
        select_detectors=selection.select_detectors,
        area=DrawnArea(session),
    )


class _FrameTools:
    """The tools of one plot that points answer to; each is added with its first points."""

    def __init__(self, plot: models.Plot) -> None:
        self._plot = plot
        self._tap = models.TapTool(renderers=[])
        self._lasso = models.LassoSelectTool(renderers=[], continuous=False)
        self._box = models.BoxSelectTool(renderers=[], continuous=False)

    def tap_among(self, renderer: models.DataRenderer) -> None:
        """Let a tap reach the points."""
        self._extend(self._tap, renderer)

    def select_anywhere(self) -> None:
        """Have a box and a lasso, even where there are no points."""
        self._plot.add_tools(self._box, self._lasso)
        self._plot.toolbar.active_drag = self._box

    def select_among(self, renderer: models.DataRenderer) -> None:
        """Let a tap, a box and a lasso reach the points; a drag is a box."""
        for tool in (self._tap, self._box, self._lasso):
            self._extend(tool, renderer)
        # BokehJS 3 reports an error for a drag of its lasso that begins beside the frame.
        self._plot.toolbar.active_drag = self._box

    def _extend(
        self,
        tool: models.TapTool | models.LassoSelectTool | models.BoxSelectTool,
        renderer: models.DataRenderer,
    ) -> None:
        if tool not in self._plot.tools:
            self._plot.add_tools(tool)
        before = [one for one in tool.renderers if isinstance(one, models.DataRenderer)]
        tool.renderers = [*before, renderer]


def selected_column(glyphs: BokehGlyphs) -> str | None:
    """Return the column by which rows are selected; None if they are not."""
    return next(iter(glyphs.keys), None)


def _rows(glyphs: BokehGlyphs, selected: SelectedIds) -> set[int]:
    """Return the rows of any selected source, exposure or detector."""
    return {
        row
        for column, ids in selected.items()
        if column in glyphs.keys and ids
        for row, one in enumerate(glyphs.keys[column])
        if str(one) in ids
    }


def _item(column: str, text: str) -> int | tuple[int, int] | None:
    return labelled_exposure(text) if column == "exposure" else int(text)


def _corners(geometry: Mapping[str, object]) -> np.ndarray | None:
    """Return the corners of an area that the browser has sent; None for anything else."""
    try:
        if geometry["type"] == "rect":
            x0, x1, y0, y1 = (float(geometry[name]) for name in ("x0", "x1", "y0", "y1"))  # type: ignore[arg-type]
            corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        elif geometry["type"] == "poly":
            corners = np.stack([geometry["x"], geometry["y"]], axis=1).astype(float)  # type: ignore[list-item]
        else:
            return None
    except (KeyError, TypeError, ValueError):
        return None
    # A hand draws hundreds of corners; each takes its time for every row.
    corners = corners[:: len(corners) // _MOST_CORNERS + 1]
    return corners if np.isfinite(corners).all() else None
