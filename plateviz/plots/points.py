"""Elements shared by plots: points by class, rasters of many points, histograms, error bars."""

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

# Number of images for zooming in, and the factor of resolution from one to the next.
_LEVELS, _FINER = 3, 2
Tooltips = Sequence[tuple[str, str]]


def class_points(
    table: pd.DataFrame, x: hv.Dimension, y: hv.Dimension, *, hover: Tooltips, extra: list[str]
) -> hv.Points:
    """Return one element with a point per row, coloured and shaped by `source_class`.

    It is one element instead of one per class, so that the index of a selected point is the
    row of the table.

    Parameters
    ----------
    table : with `id` (text), `source_class` and the columns of `x`, `y` and `extra`
    x, y : dimensions to draw
    hover : label and format of each line of the hover
    extra : other columns that the hover needs
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
    """Return the number of points per cell about zero as images, one of which is visible.

    Parameters
    ----------
    points : the points to count
    half : points are counted in the square from -half to half
    width : of the frame in screen pixels
    theme : "light" or "dark"
    dynamic : True for a live plot, with one image that is counted again at each zoom; otherwise
        one image of the whole square, and finer ones about its centre that replace it when
        zooming in
    """
    # Imported here, because Datashader and Numba take seconds and 150 MB to load.
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
            # Counts are scaled to cells of the whole image, so that one colour scale is valid.
            image.transform(
                **{image.vdims[0].name: dim(image.vdims[0]) * float(_FINER ** (2 * i))}
            ),
            **_cells(theme),
            clim=(1.0, max(dense, 2.0)),
            colorbar=i == 0,
            hooks=[_visible_between(halves[i + 1] if i + 1 < _LEVELS else 0.0, halves[i], i == 0)],
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


def _visible_between(least: float, most: float, is_whole: bool) -> Callable:
    """Return a hook that shows an image while the frame's reach is from `least` to `most`."""
    code = """
        const ends = [x.start, x.end, y.start, y.end].map(Math.abs);
        const reach = Math.max(...ends);
        image.visible = reach > least && (whole || reach <= most);
    """

    def apply(plot: object, element: hv.Element) -> None:
        figure, image = plot.state, plot.handles["glyph_renderer"]  # type: ignore[attr-defined]
        image.visible = is_whole
        models = {"x": figure.x_range, "y": figure.y_range, "image": image}
        # The edge of the frame lies slightly outside the data.
        limits = {"least": 1.01 * least, "most": 1.01 * most, "whole": is_whole}
        callback = CustomJS(args={**models, **limits}, code=code)
        for axis in (figure.x_range, figure.y_range):
            axis.js_on_change("start", callback)
            axis.js_on_change("end", callback)

    return apply


def steps(bins: pd.DataFrame, name: str, colour: str) -> hv.Curve:
    """Return a histogram (`left`, `right` and `count` of each bin) as an outline."""
    edges = np.append(bins["left"].to_numpy(), bins["right"].to_numpy()[-1])
    counts = np.append(bins["count"].to_numpy(), bins["count"].to_numpy()[-1])
    curve = hv.Curve((edges, counts), "edge", "count", label=name)
    return drawn(curve, interpolation="steps-post", color=colour, line_width=1.8)


def unit_normal(area: float, limit: float, theme: str) -> hv.Curve:
    """Return a unit normal with the area of a histogram, from -limit to limit."""
    # A finer grid than the bins, so that the curve is smooth.
    x = np.linspace(-limit, limit, 241)
    normal = area * np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi)
    curve = hv.Curve((x, normal), "x", "count", label="unit normal")
    return drawn(curve, color=theme_of(theme).line, line_width=1.6)


def error_bars(
    table: pd.DataFrame, x: str, y: str, sigma: str, colour: str, *, along: str = "y"
) -> hv.Segments:
    """Return a bar of one `sigma` on both sides of each point, along "x" or "y"."""
    ends = {f"{axis}{end}": table[name] for axis, name in (("x", x), ("y", y)) for end in "01"}
    for end, sign in (("0", -1.0), ("1", 1.0)):
        ends[f"{along}{end}"] = table[y if along == "y" else x] + sign * table[sigma]
    bars = hv.Segments(pd.DataFrame(ends), ["x0", "y0", "x1", "y1"])
    return drawn(bars, color=colour, alpha=0.45, line_width=1.2, show_legend=False)
