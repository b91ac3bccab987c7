"""Any column of a table against any other, with their histograms along both axes."""

from typing import Any

import numpy as np

from plateviz.figures.figure import (
    FRAME_WIDTH,
    Axis,
    Figure,
    Glyphs,
    Limits,
    Ramp,
    framed,
    message,
)
from plateviz.figures.glyphs import band, line, points, rectangles
from plateviz.plots.elements.cells import Counts, cells, scaled, unscaled
from plateviz.plots.elements.style import CLASS_COLOURS, ROW_LIMIT
from plateviz.plots.explore.explored_names import NAMES, ramp_of_names
from plateviz.plots.explore.explored_points import (
    RowsInFrame,
    explored_points,
    named,
    span_of,
    unit_behind,
)
from plateviz.plots.explore.explored_rows import (
    DataExtent,
    ExploredColumns,
    counts_in_frame,
    extent_of,
    rows_in_frame,
)
from plateviz.tables.explore import ExplorableTable
from plateviz.tables.rounded import rounded
from plateviz.tables.sources import REFERENCE

# Right ascension increases to the left, as on the sky.
_LEFTWARDS = ("ra", "prior_ra")
_MARGIN = 0.04
# Of a frame that is zoomed out from the rows, on each side, over the length of that with all rows.
_FARTHEST = 5.0
# Share of the frame that the highest bin of a histogram reaches.
_HIGHEST = 0.1


def explored_figure(
    table: ExplorableTable,
    chosen: ExploredColumns,
    *,
    selected: frozenset[Any] = frozenset(),
    extent: DataExtent | None = None,
    width: int = FRAME_WIDTH,
) -> Figure:
    """Draw a column against another; above 20,000 rows in the frame, their number in cells.

    Parameters
    ----------
    table : as `tables.explore` makes it
    chosen : the columns; KeyError if the table has none of that name
    selected : items of `ExploredColumns.selects` that are marked in cells; among points, they are
        marked where the figure is drawn
    extent : `extent_of` the table and the columns, if it is known
    width : of the frame, screen pixels
    """
    title = f"{chosen.y} against {chosen.x}"
    extent = extent or extent_of(table, chosen)
    columns = [table.columns[name] for name in (chosen.x, chosen.y)]
    labels = [named(column.meaning, column) for column in columns]
    if not extent.n_shown:
        text = f"No {table.rows} to draw"
        return message(title, text, width=width, xlabel=labels[0], ylabel=labels[1])
    zoomed = chosen.limits or ((), ())
    x = _axis(labels[0], extent.x, zoomed[0], chosen.is_log_x, chosen.x in _LEFTWARDS)
    y = _axis(labels[1], extent.y, zoomed[1], chosen.is_log_y)
    counts = counts_in_frame(table, chosen, x, y)
    words = _counted(table, extent, chosen)
    if chosen.limits is not None and counts.number < extent.n_shown:
        words.append(f"{counts.number:,} in the frame")
    if min(counts.number, extent.n_shown) > ROW_LIMIT:
        drawn = [_cells(table, chosen, counts, (x, y))]
        drawn += _selected(table, chosen, (x, y), selected, words)
    else:
        # All rows, if they are few, so that the frame can be moved without a new figure.
        limits = (x.limits, y.limits) if extent.n_shown > ROW_LIMIT else None
        rows = rows_in_frame(table, chosen, limits)
        drawn = [explored_points(RowsInFrame(table, chosen, rows), chosen)]
    if chosen.has_median:
        drawn += _medians(counts)
        words += _in_numbers(counts, unit_behind(table, chosen.y))
    return framed(
        [*_histograms(counts, x, y), *drawn],
        title=title,
        subtitle="; ".join(words),
        x=x,
        y=y,
        width=width,
        height=round(0.6 * width),
        legend_columns=3,
    )


def _axis(
    label: str,
    ends: Limits,
    zoomed: tuple[float, ...],
    is_log: bool,
    is_leftwards: bool = False,
) -> Axis:
    whole = _limits(ends, is_log, is_leftwards)
    limits = _within_reach(_valid(zoomed, is_log) or whole, whole, is_log)
    return Axis(label, limits, is_log=is_log, is_grouped="(yr)" not in label)


def _valid(limits: tuple[float, ...], is_log: bool) -> Limits | None:
    """Return limits that an axis can have, otherwise None."""
    if len(limits) != 2 or limits[0] == limits[1] or (is_log and min(limits) <= 0.0):
        return None
    return limits[0], limits[1]


def _within_reach(limits: Limits, whole: Limits, is_log: bool) -> Limits:
    """Return limits that do not leave all rows in a single cell, nor numbers of many digits."""
    low, high = sorted(scaled(np.array(whole), is_log).tolist())
    reach = _FARTHEST * (high - low)
    places = scaled(np.array(limits), is_log)
    nearer = np.clip(places, low - reach, high + reach)
    if (nearer == places).all():
        return limits
    first, last = map(float, unscaled(nearer, is_log))
    return whole if first == last else (first, last)


def _limits(ends: Limits, is_log: bool, is_leftwards: bool) -> Limits:
    low, high = scaled(np.array(ends), is_log)
    margin = _MARGIN * (high - low) or (0.5 * abs(low) or 0.5)
    first, last = map(float, unscaled(np.array([low - margin, high + margin]), is_log))
    return (last, first) if is_leftwards else (first, last)


def _histograms(counts: Counts, x: Axis, y: Axis) -> list[Glyphs]:
    """Return the histograms of what is in the frame, along its lower and left edges."""
    found = []
    for number, name, axis, (along, across) in (
        (0, "histogram of x", y, (("left", "right"), ("bottom", "top"))),
        (1, "histogram of y", x, (("bottom", "top"), ("left", "right"))),
    ):
        edges, n = counts.histogram(number)
        start, end = scaled(np.array(axis.limits), axis.is_log)
        tops = unscaled(start + (end - start) * _HIGHEST * n / max(n.max(), 1), axis.is_log)
        table = {along[0]: edges[:-1], along[1]: edges[1:]}
        table |= {across[0]: np.full(len(tops), axis.limits[0]), across[1]: tops}
        found.append(rectangles(table, name=name, color="grid"))
    return found


def _cells(
    table: ExplorableTable, chosen: ExploredColumns, counts: Counts, axes: tuple[Axis, Axis]
) -> Glyphs:
    at = [
        (name, f"${axis}{{0.0000}}{unit_behind(table, name)}")
        for axis, name in (("x", chosen.x), ("y", chosen.y))
    ]
    if not chosen.colour:
        numbers = counts.image()
        most = max(float(np.nanmax(numbers, initial=2.0)), 2.0)
        label = f"{table.rows} per cell"
        ramp = Ramp("count", "count", (1.0, most), is_log=True, label=label)
        hover = [*at, (label, "@count{0,0}")]
        return cells(numbers, *axes, name="cells by number", ramp=ramp, hover=hover)
    if counts.names is not None:
        label = f"most frequent {NAMES[chosen.colour]} per cell"
        ramp = ramp_of_names(counts.names, label)
        hover = [*at, (label, "@{value}{0}")]
        return cells(counts.most_frequent(), *axes, name="cells by name", ramp=ramp, hover=hover)
    means, label = counts.means(), f"mean {chosen.colour} per cell"
    with_unit = named(label, table.columns[chosen.colour])
    ramp = Ramp("value", "count", span_of(means.ravel()), label=with_unit)
    hover = [*at, (label, f"@{{value}}{{0.0000}}{unit_behind(table, chosen.colour)}")]
    return cells(means, *axes, name="cells by value", ramp=ramp, hover=hover)


def _selected(
    table: ExplorableTable,
    chosen: ExploredColumns,
    axes: tuple[Axis, Axis],
    selected: frozenset[Any],
    words: list[str],
) -> list[Glyphs]:
    """Return the rows of what is selected as points over the cells; say if they are too many."""
    kind = table.kind(chosen.selects)
    if not selected or not kind:
        return []
    rows = rows_in_frame(table, chosen, (axes[0].limits, axes[1].limits), selected)
    if len(rows) > ROW_LIMIT:
        words.append(f"{len(rows):,} of selected {kind}, too many to be marked")
    if not 0 < len(rows) <= ROW_LIMIT:
        return []
    # Under names that are not selected by: these points show what is selected.
    names = {"id": "source", "exposure": "in exposure", "detector_id": "on detector"}
    marks = RowsInFrame(table, chosen, rows).frame.rename(columns=names)
    label = f"selected {kind}"
    colour = CLASS_COLOURS[REFERENCE]  # visible on dark and on light cells
    hover = [(name, f"@{{{name}}}") for name in names.values() if name in marks]
    return [points(marks, "x", "y", name=label, color=colour, size=3.0, hover=hover, label=label)]


def _medians(counts: Counts) -> list[Glyphs]:
    x, low, median, high = counts.medians()
    return [
        band(x, low, high, name="16 to 84 %", label="16 to 84 %"),
        # Cells have all shades between the background and the colour of lines.
        line(x, median, name="edge of the median", color="background", width=6.0),
        line(x, median, name="median", color="line", width=2.0, label="median"),
    ]


def _in_numbers(counts: Counts, unit: str) -> list[str]:
    median = counts.medians().median
    if not len(median):
        return []
    return [f"medians from {rounded(median.min(), 3)} to {rounded(median.max(), 3)}{unit}"]


def _counted(table: ExplorableTable, extent: DataExtent, chosen: ExploredColumns) -> list[str]:
    shown, total = extent.n_shown, table.size
    words = [f"{shown:,} of {total:,} {table.rows}" if shown < total else f"{total:,} {table.rows}"]
    if table.note:
        words.append(table.note)
    if extent.n_left_out:
        words.append(f"{extent.n_left_out:,} not between the limits of {chosen.only}")
    without = total - extent.n_left_out - shown
    if without:
        is_log = chosen.is_log_x or chosen.is_log_y
        words.append(f"{without:,} without a {'positive ' if is_log else ''}value on these axes")
    return words
