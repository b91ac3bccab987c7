"""Links: a tap on the point of a source or an orbit opens it."""

from collections.abc import Callable, Mapping
from functools import partial

import holoviews as hv
import panel as pn
from bokeh.models import ColumnDataSource, DataRenderer, TapTool
from bokeh.plotting import figure as Figure  # noqa: N812  a class by another name
from holoviews.plotting.bokeh.element import ElementPlot

Links = Mapping[str, Callable[[str], object]]
"""Column of a point's data -> function that is called with its value as text."""


def rendered(element: hv.core.Dimensioned) -> hv.plotting.Plot:
    """Return the plot of an element, with its Bokeh models, for the page of this session."""
    renderer = hv.renderer("bokeh").instance(mode="server")
    return renderer.get_plot(element, doc=pn.state.curdoc)


def follow_taps(plot: hv.plotting.Plot, links: Links) -> None:
    """Call the function of a link when its point is tapped.

    Parameters
    ----------
    links : the first one whose column is in the data of the point is used
    """
    found: dict[Figure, list[DataRenderer]] = {}
    for part in plot.traverse(specs=[ElementPlot]):
        source, glyphs = part.handles.get("cds"), part.handles.get("glyph_renderer")
        if source is None or glyphs is None:
            continue
        column = next((name for name in links if name in source.data), None)
        if column is not None:
            source.selected.on_change("indices", partial(_open_link, source, column, links[column]))
            found.setdefault(part.handles["plot"], []).append(glyphs)
    for figure, renderers in found.items():
        figure.add_tools(TapTool(renderers=renderers))


def _open_link(
    source: ColumnDataSource,
    column: str,
    call: Callable[[str], object],
    name: str,
    old: list[int],
    new: list[int],
) -> None:
    if new:
        # A tap is not a selection: the other points must not stay faded.
        source.selected.indices = []
        call(str(source.data[column][new[0]]))
