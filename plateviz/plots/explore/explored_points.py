"""The rows of a table that *Explore* draws one by one, as points."""

import numpy as np
import pandas as pd

from plateviz.figures.figure import By, Glyphs, Limits, Ramp
from plateviz.figures.glyphs import points
from plateviz.plots.elements.style import COLOUR_OF_CLASS, SERIES_COLOURS
from plateviz.plots.explore.explored_names import NAMES, names_in
from plateviz.plots.explore.explored_rows import ExploredColumns
from plateviz.tables.explore import ExplorableTable
from plateviz.tables.labels import exposure_labels, id_strings, unit_text
from solver.data.columns import Column

# Colours span these percentiles: a few extreme values must not decide them.
_SPAN = (1.0, 99.0)


class RowsInFrame:
    """The rows that are drawn one by one."""

    def __init__(self, table: ExplorableTable, chosen: ExploredColumns, rows: np.ndarray) -> None:
        self.table, self.rows = table, rows
        self.frame = pd.DataFrame({"x": self.column(chosen.x), "y": self.column(chosen.y)})
        kind = table.kind(chosen.selects)
        if table.has_sources:
            sources = table.sources()
            codes = sources.codes[rows]
            # Rows are selected by the column of this name.
            self.source = "id" if kind == "sources" else "source"
            self.frame[self.source] = id_strings(pd.Series(sources.ids[codes]))
            if sources.classes is not None:
                self.frame["source_class"] = sources.classes[codes]
        for name, words in table.words.items():
            self.frame[name] = words(rows)
        if kind == "exposures":
            keys = {name: table.read(name)[rows] for name in ("field_id", "plate_id")}
            self.frame["exposure"] = exposure_labels(pd.DataFrame(keys))
        elif kind == "detectors":
            self.frame["detector_id"] = table.read("detector_id")[rows]

    def column(self, name: str) -> np.ndarray:
        """Return a column of these rows."""
        return self.table.numbers(name)[self.rows]


def named(name: str, column: Column) -> str:
    """Return a name with the unit of a column in brackets."""
    return f"{name} ({unit_text(column.unit)})" if column.unit else name


def unit_behind(table: ExplorableTable, name: str) -> str:
    """Return the unit of a column as it stands behind a number; empty without one."""
    unit = table.columns[name].unit if name else ""
    return f" {unit_text(unit)}" if unit else ""


def number_form(table: ExplorableTable, name: str) -> str:
    """Return how a hover writes a number of a column: whole ones without decimals."""
    return "{0}" if table.columns[name].dtype == "int64" else "{0.0000}"


def explored_points(data: RowsInFrame, chosen: ExploredColumns) -> Glyphs:
    """Return the rows as points in the colours of a column, or of the classes of sources."""
    table, has_sources = data.frame, data.table.has_sources
    hover = [("source", f"@{{{data.source}}}")] if has_sources else []
    hover += [(name, f"@{{{name}}}") for name in data.table.words]
    units = {name: unit_behind(data.table, name) for name in (chosen.x, chosen.y, chosen.colour)}
    hover += [
        (name, f"@{{{at}}}{number_form(data.table, name)}{units[name]}")
        for at, name in (("x", chosen.x), ("y", chosen.y))
    ]
    keep = [name for name in table if name not in ("x", "y", "source_class")]
    if chosen.colour:
        values = data.column(chosen.colour)
        # Of all rows: a zoom must not change the colour of a detector.
        names = names_in(data.table, chosen.colour)
        if names is not None and len(names) <= len(SERIES_COLOURS):
            return _by_name(table, chosen.colour, values, names, hover, keep)
        table["colour"] = values
        label = named(chosen.colour, data.table.columns[chosen.colour])
        ramp = Ramp("colour", "count", span_of(values), label=label)
        form = number_form(data.table, chosen.colour)
        hover.append((chosen.colour, f"@{{colour}}{form}{units[chosen.colour]}"))
        return points(
            table, "x", "y", name="rows by value", color=ramp, size=4.5, hover=hover, keep=keep
        )
    if "source_class" in table:
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


def _by_name(
    table: pd.DataFrame,
    column: str,
    values: np.ndarray,
    names: np.ndarray,
    hover: list[tuple[str, str]],
    keep: list[str],
) -> Glyphs:
    """Return the rows in a colour for each value of a column that is no size, such as detectors."""
    word = NAMES[column]
    labels = {value: f"{word} {value:.0f}" for value in names.tolist()}
    table["colour"] = [labels[value] for value in values.tolist()]
    return points(
        # The legend has the names in the order of the rows.
        table.iloc[np.argsort(values, kind="stable")],
        "x",
        "y",
        name=f"rows by {word}",
        color=By("colour", dict(zip(labels.values(), SERIES_COLOURS, strict=False))),
        size=4.5,
        hover=hover,
        label="@colour",
        keep=keep,
    )


def span_of(values: np.ndarray) -> Limits:
    """Return the limits of the colours of values."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return 0.0, 1.0
    low, high = (float(end) for end in np.percentile(finite, _SPAN))
    return (low, high) if high > low else (low - 0.5, low + 0.5)
