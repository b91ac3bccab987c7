"""Any column of a table against any other, with their histograms along both axes."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from plateviz.figures.figure import FRAME_WIDTH, Axis, Figure, Glyphs, Limits, Ramp, framed, message
from plateviz.figures.glyphs import band, line, points, rectangles
from plateviz.plots.cells import (
    cells,
    counts_in_cells,
    edges_of,
    means_in_cells,
    scaled,
    unscaled,
)
from plateviz.plots.style import CLASS_COLOURS, COLOUR_OF_CLASS, ROW_LIMIT
from plateviz.tables.explore import ExplorableTable
from plateviz.tables.labels import exposure_labels, id_strings, unit_text
from plateviz.tables.sources import REFERENCE
from solver.data.columns import Column

# Right ascension increases to the left, as on the sky.
_LEFTWARDS = ("ra", "prior_ra")
_MARGIN = 0.04
# Bins of a histogram, and the share of the frame that its highest bin reaches.
_BINS, _HIGHEST = 60, 0.1
_MEDIANS, _LEAST_IN_BIN = 30, 8
# Colours span these percentiles: a few extreme values must not decide them.
_SPAN = (1.0, 99.0)


@dataclass(frozen=True)
class Columns:
    """What is drawn against what.

    Attributes
    ----------
    x, y : names of columns
    colour : name of a column; empty for the class of the source, or for the number in each cell
    only : name of a column whose values between `lowest` and `highest` are drawn; empty for all
    is_log_x, is_log_y : whether the axes are logarithmic
    has_median : whether the median of y is drawn in bins of x
    limits : of x and y; None for those of the data
    """

    x: str
    y: str
    colour: str = ""
    only: str = ""
    lowest: float = -np.inf
    highest: float = np.inf
    is_log_x: bool = False
    is_log_y: bool = False
    has_median: bool = False
    limits: tuple[Limits, Limits] | None = None


def explored_figure(
    table: ExplorableTable,
    chosen: Columns,
    *,
    selected: frozenset[int] = frozenset(),
    width: int = FRAME_WIDTH,
) -> Figure:
    """Draw a column against another; above 20,000 rows, their number in cells.

    Parameters
    ----------
    table : as `tables.explore` makes it
    chosen : the columns; KeyError if the table has none of that name
    selected : ids of sources that are marked in cells; among points, those of a source are
        marked where the figure is drawn
    width : of the frame, screen pixels
    """
    title = f"{chosen.y} against {chosen.x}"
    x, y = table.numbers(chosen.x), table.numbers(chosen.y)
    is_kept = kept_rows(table, chosen)
    has_values = _drawable(x, chosen.is_log_x) & _drawable(y, chosen.is_log_y)
    shown = np.flatnonzero(is_kept & has_values)
    labels = [_label(table.columns[name]) for name in (chosen.x, chosen.y)]
    if not len(shown):
        text = f"No {table.rows} to draw"
        return message(title, text, width=width, xlabel=labels[0], ylabel=labels[1])
    zoomed = chosen.limits or ((), ())
    x_axis = _axis(labels[0], x[shown], zoomed[0], chosen.is_log_x, chosen.x in _LEFTWARDS)
    y_axis = _axis(labels[1], y[shown], zoomed[1], chosen.is_log_y)
    data = _Data(table, shown, x[shown], y[shown], x_axis, y_axis)
    if len(shown) > ROW_LIMIT:
        drawn = [_cells(data, chosen), *_selected(data, selected)]
    else:
        drawn = [_points(data, chosen)]
    return framed(
        [*_histograms(data), *drawn, *(_medians(data) if chosen.has_median else ())],
        title=title,
        subtitle=_counted(table, len(shown), int(np.sum(~is_kept)), chosen),
        x=x_axis,
        y=y_axis,
        width=width,
        height=round(0.6 * width),
        legend_columns=3,
    )


@dataclass(frozen=True, eq=False)
class _Data:
    """The rows that are drawn: their numbers in the table, and their values on both axes."""

    table: ExplorableTable
    shown: np.ndarray
    x: np.ndarray
    y: np.ndarray
    x_axis: Axis
    y_axis: Axis

    def column(self, name: str) -> np.ndarray:
        return self.table.numbers(name)[self.shown]

    def rows(self, among: np.ndarray) -> pd.DataFrame:
        """Return the drawn rows `among` all, with words for a hover."""
        table, places = self.table, self.shown[among]
        found = pd.DataFrame({"x": self.x[among], "y": self.y[among]})
        if table.has_sources:
            found["id"] = id_strings(pd.Series(table.read("source_id")[places]))
        else:
            keys = ("field_id", "plate_id")
            exposures = pd.DataFrame({key: table.read(key)[places] for key in keys})
            found["exposure"] = exposure_labels(exposures)
        if table.has_classes:
            found["source_class"] = table.read("source_class")[places]
        return found


def kept_rows(table: ExplorableTable, chosen: Columns) -> np.ndarray:
    """Return whether each row is between the limits of the column that limits them."""
    if not chosen.only:
        return np.ones(table.size, dtype=bool)
    values = table.numbers(chosen.only)
    return (values >= chosen.lowest) & (values <= chosen.highest)


def _drawable(values: np.ndarray, is_log: bool) -> np.ndarray:
    return np.isfinite(values) & ((values > 0) | (not is_log))


def _label(column: Column) -> str:
    return f"{column.meaning} ({unit_text(column.unit)})" if column.unit else column.meaning


def _axis(
    label: str,
    values: np.ndarray,
    zoomed: tuple[float, ...],
    is_log: bool,
    is_leftwards: bool = False,
) -> Axis:
    limits = _valid(zoomed, is_log) or _limits(values, is_log, is_leftwards)
    return Axis(label, limits, is_log=is_log)


def _valid(limits: tuple[float, ...], is_log: bool) -> Limits | None:
    """Return limits that an axis can have, otherwise None."""
    if len(limits) != 2 or limits[0] == limits[1] or (is_log and min(limits) <= 0.0):
        return None
    return limits[0], limits[1]


def _limits(values: np.ndarray, is_log: bool, is_leftwards: bool) -> Limits:
    low, high = scaled(np.array([values.min(), values.max()]), is_log)
    margin = _MARGIN * (high - low) or (0.5 * abs(low) or 0.5)
    ends = unscaled(np.array([low - margin, high + margin]), is_log)
    first, last = float(ends[0]), float(ends[1])
    return (last, first) if is_leftwards else (first, last)


def _histograms(data: _Data) -> list[Glyphs]:
    """Return the histogram of each axis, along that axis."""
    along_x, along_y = _bars(data.x, data.x_axis), _bars(data.y, data.y_axis)
    found = []
    for name, bars, axis, (along, across) in (
        ("histogram of x", along_x, data.y_axis, (("left", "right"), ("bottom", "top"))),
        ("histogram of y", along_y, data.x_axis, (("bottom", "top"), ("left", "right"))),
    ):
        start, end = scaled(np.array(axis.limits), axis.is_log)
        tops = unscaled(start + (end - start) * _HIGHEST * bars["share"], axis.is_log)
        table = {along[0]: bars["low"], along[1]: bars["high"]}
        table |= {across[0]: np.full(len(tops), axis.limits[0]), across[1]: tops}
        found.append(rectangles(table, name=name, color="grid"))
    return found


def _bars(values: np.ndarray, axis: Axis) -> dict[str, np.ndarray]:
    edges = edges_of(axis, _BINS)
    counts, _ = np.histogram(values, edges)
    return {"low": edges[:-1], "high": edges[1:], "share": counts / max(counts.max(), 1)}


def _points(data: _Data, chosen: Columns) -> Glyphs:
    table = data.rows(np.arange(len(data.shown)))
    has_sources = data.table.has_sources
    hover = [
        ("source", "@{id}") if has_sources else ("exposure", "@{exposure}"),
        (chosen.x, "@{x}{0.0000}"),
        (chosen.y, "@{y}{0.0000}"),
    ]
    keep = ["id"] if has_sources else []
    if chosen.colour:
        values = data.column(chosen.colour)
        table["colour"] = values
        ramp = Ramp("colour", "count", _span(values), label=chosen.colour)
        hover.append((chosen.colour, "@{colour}{0.0000}"))
        return points(
            table, "x", "y", name="rows by value", color=ramp, size=4.5, hover=hover, keep=keep
        )
    if data.table.has_classes:
        return points(
            table,
            "x",
            "y",
            name="rows by class",
            color=COLOUR_OF_CLASS,
            size=4.0,
            alpha=0.7,
            hover=hover,
            label="@source_class",
            keep=keep,
        )
    return points(table, "x", "y", name="rows", color="mark", size=6.0, hover=hover, keep=keep)


def _span(values: np.ndarray) -> Limits:
    finite = values[np.isfinite(values)]
    if not len(finite):
        return 0.0, 1.0
    low, high = (float(end) for end in np.percentile(finite, _SPAN))
    return (low, high) if high > low else (low - 0.5, low + 0.5)


def _cells(data: _Data, chosen: Columns) -> Glyphs:
    axes = data.x_axis, data.y_axis
    if not chosen.colour:
        counts = counts_in_cells(data.x, data.y, *axes)
        most = max(float(np.nanmax(counts, initial=2.0)), 2.0)
        label = f"{data.table.rows} per cell"
        ramp = Ramp("count", "count", (1.0, most), is_log=True, label=label)
        return cells(counts, *axes, name="cells by number", ramp=ramp)
    means = means_in_cells(data.x, data.y, data.column(chosen.colour), *axes)
    ramp = Ramp("value", "count", _span(means.ravel()), label=f"mean {chosen.colour} per cell")
    return cells(means, *axes, name="cells by value", ramp=ramp)


def _selected(data: _Data, selected: frozenset[int]) -> list[Glyphs]:
    """Return the rows of selected sources as points over the cells, unless they are too many."""
    if not selected or not data.table.has_sources:
        return []
    ids = data.table.read("source_id")[data.shown]
    among = np.flatnonzero(np.isin(ids, np.fromiter(selected, dtype=np.int64)))
    if not 0 < len(among) <= ROW_LIMIT:
        return []
    # Without an `id`: these points show what is selected, and are not selected from.
    table = data.rows(among).rename(columns={"id": "source"})
    label = "selected sources"
    colour = CLASS_COLOURS[REFERENCE]  # visible on dark and on light cells
    hover = [("source", "@{source}")]
    return [points(table, "x", "y", name=label, color=colour, size=3.0, hover=hover, label=label)]


def _medians(data: _Data) -> list[Glyphs]:
    """Return the median of y in bins of x, and the range that has two thirds of its values."""
    edges = edges_of(data.x_axis, _MEDIANS)
    groups = pd.Series(data.y).groupby(np.digitize(data.x, edges))
    middles = unscaled(
        np.convolve(scaled(edges, data.x_axis.is_log), [0.5, 0.5], "valid"), data.x_axis.is_log
    )
    counts = groups.size()
    full = [b for b in counts.index[counts >= _LEAST_IN_BIN] if 1 <= b <= _MEDIANS]
    low, median, high = (groups.quantile(q).loc[full].to_numpy() for q in (0.16, 0.5, 0.84))
    x = middles[np.array(full, dtype=int) - 1]
    return [
        band(x, low, high, name="16 to 84 %", label="16 to 84 %"),
        line(x, median, name="median", color="line", width=2.0, label="median"),
    ]


def _counted(table: ExplorableTable, shown: int, left_out: int, chosen: Columns) -> str:
    total = table.size
    words = [f"{shown:,} of {total:,} {table.rows}" if shown < total else f"{total:,} {table.rows}"]
    if left_out:
        words.append(f"{left_out:,} not between the limits of {chosen.only}")
    without = total - left_out - shown
    if without:
        words.append(f"{without:,} without a value on these axes")
    return "; ".join(words)
