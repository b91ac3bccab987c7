"""Colours, sizes and fonts of every plot, and the one function that applies them."""

import functools
import operator
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import TypedDict, TypeVar

import holoviews as hv
import holoviews.plotting.bokeh  # noqa: F401  registers the options of the backend
from bokeh.models import BoxZoomTool, ColorBar, HoverTool, Title
from bokeh.plotting import figure as Figure  # noqa: N812  a class by another name

from plateviz.plots.theme import Theme, theme_of
from plateviz.tables.sources import ARTIFICIAL, NON_REFERENCE, REFERENCE

Limits = tuple[float, float]


class AxisLabels(TypedDict):
    """Labels of both axes, with their units."""

    xlabel: str
    ylabel: str


_Model = TypeVar("_Model")

BACKEND = "bokeh"
ROW_LIMIT = 20_000
"""Number of glyphs above which a plot is rasterised or reduced."""
ARROW_LIMIT = 2_000
"""Number of arrows above which the mean arrow of each bin is drawn."""
HOVER_LIMIT = 3
"""Maximum number of points that one hover describes."""
FRAME_WIDTH = 460
PANEL_WIDTH = 340

TITLE_SIZE = "13px"
LABEL_SIZE = "12px"
TICK_SIZE = "11px"
FONT = "Helvetica, Arial, sans-serif"

# From the Okabe-Ito palette, which is distinct in all common colour-vision deficiencies, with
# lightness adjusted for a contrast above 3 to 1 on both backgrounds. Marker shapes differ, too.
CLASS_COLOURS: Mapping[str, str] = MappingProxyType(
    {NON_REFERENCE: "#4291d2", ARTIFICIAL: "#12a37b", REFERENCE: "#e4602a"}
)
CLASS_MARKERS: Mapping[str, str] = MappingProxyType(
    {NON_REFERENCE: "circle", ARTIFICIAL: "triangle", REFERENCE: "x"}
)
CLASS_SIZES: Mapping[str, float] = MappingProxyType(
    {NON_REFERENCE: 4.0, ARTIFICIAL: 6.5, REFERENCE: 7.0}
)
SERIES_COLOURS = ("#4291d2", "#e4602a", "#12a37b", "#b98a00", "#b565a7", "#7a8793")


def framed(
    elements: Sequence[hv.Element | hv.DynamicMap],
    *,
    title: str,
    subtitle: str = "",
    theme: str,
    width: int,
    xlim: Limits,
    ylim: Limits,
    height: int | None = None,
    legend_columns: int = 0,
    **options: object,
) -> hv.Overlay:
    """Return the elements as one figure with a fixed frame in the project's style.

    Parameters
    ----------
    elements : drawn in order
    title, subtitle : above the frame; the subtitle is wrapped to it
    theme : "light" or "dark"
    width, height : of the frame in screen pixels; a height of None gives equal aspect
    xlim, ylim : limits of the axes; the first may be the larger
    legend_columns : columns of the legend, which is below the frame so that it covers no
        data; 0 for no legend
    options : other plot options of the overlay (labels, ticks, log axes)

    Returns
    -------
    One overlay; if `height` is None, box zoom keeps the aspect equal
    """
    equal = height is None
    if height is None:
        height = equal_height(width, xlim, ylim)
    return drawn(
        _overlaid(elements),
        title=title,
        frame_width=width,
        frame_height=height,
        xlim=xlim,
        ylim=ylim,
        show_legend=legend_columns > 0,
        legend_position="bottom",
        legend_cols=legend_columns or 1,
        show_grid=True,
        active_tools=["pan"],
        toolbar="right",
        hooks=[_styling(theme_of(theme), subtitle, width, equal)],
        **options,
    )


def _overlaid(elements: Sequence[hv.Element | hv.DynamicMap]) -> hv.Overlay | hv.DynamicMap:
    # An overlay cannot contain a DynamicMap; the product with one is a DynamicMap.
    if any(isinstance(element, hv.DynamicMap) for element in elements):
        return functools.reduce(operator.mul, elements)
    return hv.Overlay(list(elements))


def equal_height(width: int, xlim: Limits, ylim: Limits) -> int:
    """Return the frame height that gives both axes the same scale, in screen pixels."""
    return max(1, round(width * abs(ylim[1] - ylim[0]) / abs(xlim[1] - xlim[0])))


def message(
    title: str,
    text: str,
    *,
    theme: str,
    width: int = FRAME_WIDTH,
    xlabel: str = "",
    ylabel: str = "",
) -> hv.Overlay:
    """Return an empty figure with a text that gives the reason."""
    label = hv.Text(0.5, 0.5, text).opts(
        text_color=theme_of(theme).muted, text_font_size=TITLE_SIZE, backend=BACKEND
    )
    return framed(
        [hv.Points([]), label],
        title=title,
        theme=theme,
        width=width,
        height=round(0.6 * width),
        xlabel=xlabel,
        ylabel=ylabel,
        xlim=(0, 1),
        ylim=(0, 1),
        xticks=0,
        yticks=0,
    )


def side_by_side(panels: Sequence[hv.Overlay], *, columns: int, linked: bool = False) -> hv.Layout:
    """Return the figures in rows with one toolbar, shown on mouse-over.

    Parameters
    ----------
    linked : whether panels share axes of the same dimension
    """
    layout = hv.Layout(list(panels)).cols(columns)
    return drawn(layout, autohide_toolbar=True, shared_axes=linked)


def drawn(element: hv.Element, **options: object) -> hv.Element:
    """Return the element with Bokeh options."""
    return element.opts(backend=BACKEND, **options)


def _styling(theme: Theme, subtitle: str, width: int, equal: bool) -> Callable:
    # About 5.3 screen pixels per character of the subtitle's font.
    wrapped = "\n".join(
        part for line in subtitle.split("\n") for part in textwrap.wrap(line, int(width / 5.3))
    )

    def apply(plot: object, element: hv.Element) -> None:
        figure = plot.state  # type: ignore[attr-defined]
        figure.background_fill_color = figure.border_fill_color = theme.background
        figure.outline_line_color = theme.muted
        figure.sizing_mode = None
        # With WebGL, figures that replace others on an open page lose their points.
        figure.output_backend = "canvas"
        figure.toolbar.logo = None
        figure.toolbar.autohide = True
        _style_titles(figure, theme, wrapped)
        _style_axes(figure, theme)
        _style_legends(figure, theme)
        for tool in _of_type(figure.tools, BoxZoomTool):
            tool.match_aspect = equal
        for tool in _of_type(figure.tools, HoverTool):
            tool.limit = HOVER_LIMIT

    return apply


def _of_type(models: Iterable[object], kind: type[_Model]) -> list[_Model]:
    # Bokeh's `select` walks every model of the document, which takes half of the drawing time.
    return [model for model in models if isinstance(model, kind)]


def _font(part: str, colour: str, size: str, style: str = "normal") -> dict[str, str]:
    return {
        f"{part}_color": colour,
        f"{part}_font": FONT,
        f"{part}_font_size": size,
        f"{part}_font_style": style,
    }


def _style_titles(figure: Figure, theme: Theme, subtitle: str) -> None:
    for title in _of_type([figure.title, *figure.above], Title):
        title.update(**_font("text", theme.text, TITLE_SIZE, "bold"))
    # The hook runs at every update of a live plot, but the subtitle is added only once.
    found = [t for t in figure.above if isinstance(t, Title) and t.name == "subtitle"]
    if subtitle and not found:
        found = [Title(name="subtitle")]
        figure.add_layout(found[0], "above")
    for title in found:
        title.update(text=subtitle, text_line_height=1.25, **_font("text", theme.muted, TICK_SIZE))


def _style_axes(figure: Figure, theme: Theme) -> None:
    for axis in figure.axis:
        axis.update(
            axis_line_color=theme.muted,
            major_tick_line_color=theme.muted,
            minor_tick_line_color=None,
            **_font("axis_label_text", theme.text, LABEL_SIZE),
            **_font("major_label_text", theme.muted, TICK_SIZE),
        )
    for grid in figure.grid:
        grid.update(grid_line_color=theme.grid)


def _style_legends(figure: Figure, theme: Theme) -> None:
    for legend in figure.legend:
        legend.update(
            background_fill_color=None,
            border_line_color=None,
            margin=0,
            padding=2,
            spacing=7,
            label_standoff=6,
            **_font("label_text", theme.text, TICK_SIZE),
        )
    for bar in _of_type(figure.right, ColorBar):
        bar.update(
            background_fill_color=None,
            major_tick_line_color=theme.muted,
            **_font("title_text", theme.text, TICK_SIZE),
            **_font("major_label_text", theme.muted, TICK_SIZE),
        )
