"""Points by class of source, points in numbers that only a raster can show, histograms."""

from collections.abc import Sequence

import holoviews as hv
import numpy as np
import pandas as pd
from bokeh.palettes import interp_palette
from holoviews import dim

from plateviz.plots.style import (
    CLASS_COLOURS,
    CLASS_MARKERS,
    CLASS_SIZES,
    drawn,
)
from plateviz.plots.theme import theme_of

Tooltips = Sequence[tuple[str, str]]


def class_points(
    table: pd.DataFrame, x: hv.Dimension, y: hv.Dimension, *, hover: Tooltips, extra: list[str]
) -> hv.Points:
    """Return one element with a point per row, coloured and shaped by `source_class`.

    One element rather than one per class keeps the index of a selected point equal to
    the row of the table.

    Parameters
    ----------
    table : with `id` (text), `source_class` and the columns of `x`, `y` and `extra`
    x, y : dimensions to draw
    hover : label and format of each line of the hover
    extra : further columns that the hover needs
    """
    points = hv.Points(table, [x, y], ["source_class", "id", *extra])
    kind = dim("source_class")
    return drawn(
        points,
        color="source_class",
        cmap=dict(CLASS_COLOURS),
        marker=kind.categorize(dict(CLASS_MARKERS), default="circle"),
        size=kind.categorize(dict(CLASS_SIZES), default=4.0),
        line_width=1.4,
        alpha=0.85,
        nonselection_alpha=0.15,
        tools=["hover"],
        hover_tooltips=list(hover),
    )


def raster(
    points: hv.Points,
    *,
    xlim: tuple[float, float],
    ylim: tuple[float, float],
    width: int,
    height: int,
    theme: str,
    dynamic: bool,
) -> hv.Element | hv.DynamicMap:
    """Return the number of points per cell as an image.

    Parameters
    ----------
    points : to be counted
    xlim, ylim : the range counted when `dynamic` is False
    width, height : of the frame in screen pixels
    theme : "light" or "dark"
    dynamic : True for a live plot that is counted anew at each zoom
    """
    # Datashader and Numba take seconds and 150 MB to load; few plots have that many rows.
    from holoviews.operation.datashader import rasterize

    image = rasterize(
        points,
        aggregator="count",
        x_range=xlim,
        y_range=ylim,
        width=width // 2,
        height=height // 2,
        dynamic=dynamic,
    )
    return drawn(
        image,
        cmap=list(interp_palette(theme_of(theme).ramp, 256)),
        cnorm="log",
        clipping_colors={"NaN": "transparent"},
        colorbar=True,
        clabel="measurements per cell",
        colorbar_opts={"width": 10},
    )


def steps(bins: pd.DataFrame, name: str, colour: str) -> hv.Curve:
    """Return a histogram, `left`, `right` and `count` of each bin, as an outline."""
    edges = np.append(bins["left"].to_numpy(), bins["right"].to_numpy()[-1])
    counts = np.append(bins["count"].to_numpy(), bins["count"].to_numpy()[-1])
    curve = hv.Curve((edges, counts), "edge", "count", label=name)
    return drawn(curve, interpolation="steps-post", color=colour, line_width=1.8)


def unit_normal(area: float, limit: float, theme: str) -> hv.Curve:
    """Return a unit normal of the same area as a histogram, from -limit to limit."""
    # Drawn from the density at the centre of each bin, a normal would look like steps.
    x = np.linspace(-limit, limit, 241)
    normal = area * np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi)
    curve = hv.Curve((x, normal), "x", "count", label="unit normal")
    return drawn(curve, color=theme_of(theme).line, line_width=1.6)


def error_bars(
    table: pd.DataFrame, x: str, y: str, sigma: str, colour: str, *, along: str = "y"
) -> hv.Segments:
    """Return a bar of one `sigma` to both sides of each point, along "x" or "y"."""
    ends = {f"{axis}{end}": table[name] for axis, name in (("x", x), ("y", y)) for end in "01"}
    for end, sign in (("0", -1.0), ("1", 1.0)):
        ends[f"{along}{end}"] = table[y if along == "y" else x] + sign * table[sigma]
    bars = hv.Segments(pd.DataFrame(ends), ["x0", "y0", "x1", "y1"])
    return drawn(bars, color=colour, alpha=0.45, line_width=1.2, show_legend=False)
