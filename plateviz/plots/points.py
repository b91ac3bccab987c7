"""Points by class of source, points in numbers that only a raster can show, histograms."""

from collections.abc import Callable, Sequence

import holoviews as hv
import numpy as np
import pandas as pd
from bokeh.models import CustomJS
from holoviews import dim

from plateviz.plots.style import (
    CLASS_COLOURS,
    CLASS_MARKERS,
    CLASS_SIZES,
    drawn,
)
from plateviz.plots.theme import theme_of

# Images for who zooms in, each about so many times as fine as the one before.
_LEVELS, _FINER = 3, 2
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
    points: hv.Points, *, half: float, width: int, theme: str, dynamic: bool
) -> list[hv.Element | hv.DynamicMap]:
    """Return the number of points per cell about zero as images, of which one is seen at a time.

    Parameters
    ----------
    points : to be counted
    half : the square from -half to half is counted
    width : of the frame in screen pixels
    theme : "light" or "dark"
    dynamic : True for a live plot, one image that is counted anew at each zoom; else there is one
        for the whole square, and finer ones about its centre for who zooms in there
    """
    # Datashader and Numba take seconds and 150 MB to load; few plots have that many rows.
    from holoviews.operation.datashader import rasterize

    def counted(half: float) -> hv.Element | hv.DynamicMap:
        limits = (-half, half)
        return rasterize(
            points,
            aggregator="count",
            x_range=limits,
            y_range=limits,
            width=width // 2,
            height=width // 2,
            dynamic=dynamic,
        )

    whole = counted(half)
    if dynamic:
        return [drawn(whole, **_cells(theme), colorbar=True)]
    halves = [half / _FINER**level for level in range(_LEVELS)]
    images = [whole, *map(counted, halves[1:])]
    dense = float(np.nanmax(whole.dimension_values(2)))
    return [
        drawn(
            # As if the cells were those of the whole, so that one scale of colours holds for all.
            image.transform(
                **{image.vdims[0].name: dim(image.vdims[0]) * float(_FINER ** (2 * i))}
            ),
            **_cells(theme),
            clim=(1.0, max(dense, 2.0)),
            colorbar=i == 0,
            hooks=[_seen_between(halves[i + 1] if i + 1 < _LEVELS else 0.0, halves[i], i == 0)],
        )
        for i, image in enumerate(images)
    ]


def _cells(theme: str) -> dict[str, object]:
    return {
        "cmap": theme_of(theme).count_palette,
        "cnorm": "log",
        "clipping_colors": {"NaN": "transparent"},
        "clabel": "measurements per cell",
        "colorbar_opts": {"width": 10},
    }


def _seen_between(least: float, most: float, is_whole: bool) -> Callable:
    """Return a hook that shows an image while the frame reaches so far from zero, no other time."""
    code = """
        const ends = [x.start, x.end, y.start, y.end].map(Math.abs);
        const reach = Math.max(...ends);
        image.visible = reach > least && (whole || reach <= most);
    """

    def apply(plot: object, element: hv.Element) -> None:
        figure, image = plot.state, plot.handles["glyph_renderer"]  # type: ignore[attr-defined]
        image.visible = is_whole
        told = {"x": figure.x_range, "y": figure.y_range, "image": image}
        # The frame's own edge is a little farther out than the data.
        callback = CustomJS(
            args={**told, "least": 1.01 * least, "most": 1.01 * most, "whole": is_whole}, code=code
        )
        for axis in (figure.x_range, figure.y_range):
            axis.js_on_change("start", callback)
            axis.js_on_change("end", callback)

    return apply


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
