"""OpenTable: a table of pandas, and the same with units as a table of astropy."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from astropy.table import QTable

from solver.data.columns import Column
from solver.data.parameters import Axis, groups_on
from solver.data.result import FitResult
from solver.data.schema import RESULT_TABLES
from solver.units import unit_named

# Of the calibration: name of the table -> what it has a row for.
FITTED: dict[str, Axis] = {"pointings": "exp", "detectors": "det", "distortion": "coef"}
_OF_VALUE = {"value": "", "sigma_marginal": "_sigma", "prior_share": "_prior_share"}


class OpenTable(NamedTuple):
    """A table and what its columns mean."""

    frame: pd.DataFrame
    columns: Sequence[Column]

    def to_astropy(self) -> QTable:
        """Return the table with units: quantities, with the meaning of each column."""
        table = QTable()
        for column in self.columns:
            values = _values(self.frame[column.name], column)
            table[column.name] = values << unit_named(column.unit) if column.unit else values
            table[column.name].info.description = column.meaning
        return table


def result_tables(result: FitResult) -> dict[str, OpenTable]:
    """Return every table that a solution has, by name.

    Returns
    -------
    Those of `solver.data.schema.RESULT_TABLES`, and "pointings", "detectors" and "distortion": the
    fitted calibration with a row per exposure, detector and distortion term
    """
    tables = {name: _fitted(result, axis) for name, axis in FITTED.items()}
    for schema in RESULT_TABLES:
        frame = getattr(result, schema.name)
        if frame is not None:
            tables[schema.name] = OpenTable(frame, list(schema))
    return tables


def _fitted(result: FitResult, axis: Axis) -> OpenTable:
    """Return the fitted calibration on one axis, a row per element of it."""
    groups = groups_on(axis)
    columns = [Column("element", "str", "", "exposure, detector or distortion term")]
    names = [group.name for group in groups]
    rows = result.calibration[result.calibration["group"].isin(names)]
    labels = rows.groupby("element")["label"].agg(lambda words: " ".join(dict.fromkeys(words)))
    parts: dict[str, pd.Series] = {"element": labels}
    for group in groups:
        meanings = (
            group.label,
            f"marginal sigma of {group.label}",
            f"prior share of {group.label}",
        )
        units = (group.value_unit, group.unit, "")
        for (column, suffix), unit, meaning in zip(_OF_VALUE.items(), units, meanings, strict=True):
            name = group.name + suffix
            parts[name] = result.values_on(axis, column)[group.name]
            columns.append(Column(name, "float64", unit, meaning))
    return OpenTable(pd.DataFrame(parts).reset_index(drop=True), columns)


def _values(series: pd.Series, column: Column) -> np.ndarray:
    if column.dtype == "str":
        return np.array([str(text) for text in series], dtype=np.str_)
    return series.to_numpy(dtype=column.dtype)
