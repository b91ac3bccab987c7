"""Glyphs shared by plots: points by class, rasters of many points, histograms, error bars."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import Glyphs, Look, Ramp, Tooltips
from plateviz.figures.glyphs import image, line, points, segments
from plateviz.plots.elements.style import COLOUR_OF_CLASS, MARKER_OF_CLASS, SIZE_OF_CLASS

# Number of images for zooming in, and the factor of resolution from one to the next.
_LEVELS, _FINER = 3, 2


def class_points(table: pd.DataFrame, x: str, y: str, *, hover: Tooltips) -> Glyphs:
    """Return a point per row, coloured and shaped by `source_class`.

    They are one glyph table instead of one per class, so that the index of a selected point is
    the row of the table.

    Parameters
    ----------
    table : with `id` (text), `source_class`, `x`, `y` and the columns of the hover
    x, y : columns to draw
    hover : label and format of each line of the hover
    """
    return points(
        table,
        x,
        y,
        name="sources",
        color=COLOUR_OF_CLASS,
        marker=MARKER_OF_CLASS,
        size=SIZE_OF_CLASS,
        line_width=1.4,
        alpha=0.85,
        hover=hover,
        label="@source_class",
        keep=["id"],
    )


def raster(x: np.ndarray, y: np.ndarray, *, half: float, width: int) -> list[Glyphs]:
    """Return the number of points per cell about zero as images, one of which is visible.

    Parameters
    ----------
    x, y : the points to count
    half : points are counted in the square from -half to half
    width : of the frame in screen pixels

    Returns
    -------
    One image of the whole square, and finer ones about its centre that replace it when zooming in
    """
    # Imported here, because Datashader and Numba take seconds and 150 MB to load.
    import datashader

    table = pd.DataFrame({"x": x, "y": y})
    halves = [half / _FINER**level for level in range(_LEVELS)]
    images = []
    for level, reach in enumerate(halves):
        canvas = datashader.Canvas(width // 2, width // 2, (-reach, reach), (-reach, reach))
        counts = canvas.points(table, "x", "y", datashader.count()).to_numpy().astype(float)
        counts[counts == 0] = np.nan
        # Counts are scaled to cells of the whole image, so that one colour scale is valid.
        images.append(counts * float(_FINER ** (2 * level)))
    dense = max(float(np.nanmax(images[0])), 2.0)
    ends = [*halves[1:], 0.0]
    return [
        image(
            cells,
            (-reach, reach),
            (-reach, reach),
            name=f"counts {level}",
            ramp=Ramp(
                "count",
                "count",
                (1.0, dense),
                is_log=True,
                label="measurements per cell" if level == 0 else None,
            ),
            reach=(ends[level], np.inf if level == 0 else reach),
        )
        for level, (cells, reach) in enumerate(zip(images, halves, strict=True))
    ]


def steps(bins: pd.DataFrame, name: str, colour: Look) -> Glyphs:
    """Return a histogram (`left`, `right` and `count` of each bin) as an outline."""
    left, right, count = (bins[c].to_numpy(dtype=float) for c in ("left", "right", "count"))
    x, y = np.stack([left, right], axis=1).ravel(), np.repeat(count, 2)
    return line(x, y, name=name, color=colour, width=1.8, label=name)


def unit_normal(area: float, limit: float) -> Glyphs:
    """Return a unit normal with the area of a histogram, from -limit to limit."""
    # A finer grid than the bins, so that the curve is smooth.
    x = np.linspace(-limit, limit, 241)
    normal = area * np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi)
    return line(x, normal, name="unit normal", color="line", label="unit normal")


def error_bars(
    table: pd.DataFrame, x: str, y: str, sigma: str, colour: Look, *, along: str = "y"
) -> Glyphs:
    """Return a bar of one `sigma` on both sides of each point, along "x" or "y"."""
    ends = {f"{axis}{end}": table[name] for axis, name in (("x", x), ("y", y)) for end in "01"}
    for end, sign in (("0", -1.0), ("1", 1.0)):
        ends[f"{along}{end}"] = table[y if along == "y" else x] + sign * table[sigma]
    return segments(**ends, name=f"error bars along {along}", color=colour, alpha=0.45)
