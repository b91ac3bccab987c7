"""Definitions of a column (name, type, unit, meaning, aliases) and of a table."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import inf

import numpy as np
import pandas as pd


@dataclass(frozen=True)
class Column:
    """Definition of one column.

    Attributes
    ----------
    name : the canonical name, used everywhere inside the project
    dtype : "int64", "float64", "float32", "bool" or "str"
    unit : astropy unit string of the canonical table; "" where there is none
    meaning : description in one line
    aliases : other names accepted when reading, in order of preference
    required : whether a table without the column is rejected
    default : value of an optional column that is absent
    limits : lowest and highest valid value, in `unit`; wide enough for every mission, and narrow
        enough to reject a missing value, another unit or another time scale
    may_be_nan : whether NaN is valid
    """

    name: str
    dtype: str
    unit: str
    meaning: str
    aliases: tuple[str, ...] = ()
    required: bool = True
    default: float | bool | str | None = None
    limits: tuple[float, float] = (-inf, inf)
    may_be_nan: bool = False


@dataclass(frozen=True)
class Table:
    """Definition of one table.

    Attributes
    ----------
    name : in Python, and of its HDU in a file that is read
    columns, key : all columns, and those that no two rows share
    aliases : other names of its HDU accepted when reading
    file : name of its file in a run, without the suffix, where it is not `name`
    """

    name: str
    columns: tuple[Column, ...]
    key: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
    file: str = ""
    _by_name: dict[str, Column] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Index the columns by name."""
        object.__setattr__(self, "_by_name", {c.name: c for c in self.columns})

    def __getitem__(self, name: str) -> Column:
        """Return the column called `name`; KeyError if there is none."""
        return self._by_name[name]

    def __iter__(self) -> Iterator[Column]:
        """Iterate over the columns in order."""
        return iter(self.columns)

    @property
    def names(self) -> list[str]:
        """The canonical column names in order."""
        return [c.name for c in self.columns]

    def completed(self, frame: pd.DataFrame) -> pd.DataFrame:
        """Return `frame` with the optional columns that it lacks, at their defaults, in order."""
        missing = [c for c in self.columns if not c.required and c.name not in frame]
        if not missing:
            return frame
        wanted = frame.assign(**{c.name: c.default for c in missing})
        return wanted[[name for name in self.names if name in wanted]]


def numpy_dtype(column: Column) -> np.dtype:
    """Return the NumPy type of `column`."""
    return np.dtype(object if column.dtype == "str" else column.dtype)
