"""TapLinks: a tap on the point of a source or an orbit opens it."""

from collections.abc import Callable, Mapping

from bokeh.models import ColumnDataSource, DataRenderer, TapTool

from plateviz.figures.bokeh_figure import BokehFigure
from plateviz.figures.bokeh_frame import BokehFrame

Links = Mapping[str, Callable[[str], object]]
"""Column of a point's data -> function that is called with its value as text."""


class TapLinks:
    """The links of one drawn figure; the first one whose column is in a point's data is used."""

    def __init__(self, links: Links) -> None:
        """Begin without a figure."""
        self._links = links
        self._followed: set[str] = set()
        self._tools: dict[str, TapTool] = {}

    def follow(self, drawn: BokehFigure) -> None:
        """Make the points of a figure answer taps, those among them that are new."""
        for frame in drawn.frames:
            for glyphs in frame.glyphs():
                column = next((name for name in self._links if name in glyphs.source.data), None)
                if column is not None and glyphs.source.id not in self._followed:
                    self._followed.add(glyphs.source.id)
                    self._open_on_tap(glyphs.source, column)
                    self._make_tappable(frame, glyphs.renderer)

    def _open_on_tap(self, source: ColumnDataSource, column: str) -> None:
        def open_link(name: str, old: list[int], new: list[int]) -> None:
            if new:
                # A tap is not a selection: the other points must not stay faded.
                source.selected.indices = []
                self._links[column](str(source.data[column][new[0]]))

        source.selected.on_change("indices", open_link)

    def _make_tappable(self, frame: BokehFrame, renderer: DataRenderer) -> None:
        tool = self._tools.get(frame.plot.id)
        if tool is None:
            tool = self._tools[frame.plot.id] = TapTool(renderers=[])
            frame.plot.add_tools(tool)
        before = [one for one in tool.renderers if isinstance(one, DataRenderer)]
        tool.renderers = [*before, renderer]
