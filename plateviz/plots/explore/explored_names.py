"""Columns that *Explore* takes as names, such as detectors: a colour each, and no mean of them."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from plateviz.figures.figure import Ramp
from plateviz.plots.elements.style import SERIES_COLOURS
from plateviz.tables.explore import ExplorableTable

NAMES: Mapping[str, str] = MappingProxyType({"detector_id": "detector", "field_id": "field"})
"""Columns whose numbers are names, and what they name."""
# Between the first and the last name, for them to be found without sorting all rows.
_SPAN = 4096
# Each is counted in every cell.
_MOST_NAMES = 32
_PART = 2**18
_NO_NAME = "#7a8793"


def names_in(table: ExplorableTable, column: str) -> np.ndarray | None:
    """Return the names in a column, ascending: the numbers of all rows, drawn or not.

    None if its numbers are no names, or more than can be told apart.
    """
    if column not in NAMES:
        return None
    # As they are: a float for each row of a run would take 200 MB.
    values = table.read(table.columns[column].name)
    if not len(values):
        return None
    low = int(values.min())
    if values.max() - low >= _SPAN:
        return None
    is_there = np.zeros(int(values.max()) - low + 1, dtype=bool)
    for start in range(0, len(values), _PART):
        is_there[(values[start : start + _PART] - low).astype(np.intp)] = True
    names = np.flatnonzero(is_there).astype(float) + low
    return names if len(names) <= _MOST_NAMES else None


def ramp_of_names(names: np.ndarray, label: str) -> Ramp:
    """Return a colour for each name, or shades where they are too many.

    Parameters
    ----------
    names : ascending
    label : of the colour bar
    """
    first, last = int(names[0]), int(names[-1])
    limits = first - 0.5, last + 0.5
    if last - first >= 2 * len(SERIES_COLOURS) or len(names) > len(SERIES_COLOURS):
        return Ramp("value", "count", limits, label=label)
    colours = dict(zip(names.astype(int).tolist(), SERIES_COLOURS, strict=False))
    palette = tuple(colours.get(name, _NO_NAME) for name in range(first, last + 1))
    return Ramp("value", palette, limits, label=label)
