"""What a column and a table are: name, type, unit, meaning, and how to recognise them."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Column:
    """One column.

    Attributes
    ----------
    name : the canonical name, used everywhere inside the project
    dtype : "int64", "float64", "float32", "bool" or "str"
    unit : astropy unit string of the canonical table; "" where there is none
    meaning : one line for people
    aliases : other names accepted when reading, in order of preference
    required : whether a table without it is refused
    default : value of an absent optional column
    positive : whether values at or below zero are refused
    may_be_nan : whether NaN is a legitimate value
    """

    name: str
    dtype: str
    unit: str
    meaning: str
    aliases: tuple[str, ...] = ()
    required: bool = True
    default: float | bool | str | None = None
    positive: bool = False
    may_be_nan: bool = False


@dataclass(frozen=True)
class Table:
    """One table: its name (also the HDU's), its columns, and the columns that are its key."""

    name: str
    columns: tuple[Column, ...]
    key: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
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


def numpy_dtype(column: Column) -> np.dtype:
    """Return the NumPy type that holds `column`."""
    return np.dtype(object if column.dtype == "str" else column.dtype)
