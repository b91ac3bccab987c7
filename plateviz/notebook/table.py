"""OpenTable: a pandas table that converts to an astropy table with units."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from astropy.table import QTable

from solver.data.columns import Column, Table
from solver.data.parameters import Axis
from solver.data.result import FitResult
from solver.data.schema import RESULT_TABLES
from solver.errors import InputError
from solver.io.survey import read_survey_table
from solver.units import unit_named

# Table of the fitted calibration -> axis with one row per element.
FITTED: dict[str, Axis] = {"pointings": "exp", "detectors": "det", "distortion": "coef"}
_OF_VALUE = {"value": "", "sigma_marginal": "_sigma", "prior_share": "_prior_share"}


class OpenTable(NamedTuple):
    """A table with the units and meanings of its columns."""

    frame: pd.DataFrame
    columns: Sequence[Column]

    def to_astropy(self) -> QTable:
        """Return an astropy table of quantities, with the meaning of each column."""
        table = QTable()
        for column in self.columns:
            values = _values(self.frame[column.name], column)
            table[column.name] = values << unit_named(column.unit) if column.unit else values
            table[column.name].info.description = column.meaning
        return table


def result_tables(result: FitResult) -> dict[str, OpenTable]:
    """Return all tables of a solution, by name.

    Returns
    -------
    The tables of `solver.data.schema.RESULT_TABLES`, and the fitted calibration: "pointings",
    "detectors" and "distortion", with a row per exposure, detector or distortion term
    """
    tables = {name: _fitted(result, axis) for name, axis in FITTED.items()}
    for schema in RESULT_TABLES:
        frame = getattr(result, schema.name)
        if frame is not None:
            tables[schema.name] = OpenTable(frame, list(schema))
    return tables


def input_table(path: Path, schema: Table) -> OpenTable:
    """Return an input table of a survey, with the columns that it has.

    Raises
    ------
    InputError
        If the survey has no such table, or it is damaged.
    """
    if not path.is_file():
        raise InputError(f"{path}: expected a table of the survey, found none")
    frame = read_survey_table(path, schema)
    return OpenTable(frame, [column for column in schema if column.name in frame])


def _fitted(result: FitResult, axis: Axis) -> OpenTable:
    """Return the fitted calibration on one axis, a row per element."""
    groups = result.groups_on(axis)
    columns = [Column("element", "str", "", "exposure, detector or distortion term")]
    parts: dict[str, pd.Series] = {"element": result.labels_on(axis)}
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
