"""Units: the unit of angles in every figure, text and table of one browser session."""

import re
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd
import param

from plateviz.figures.figure import Figure
from plateviz.plots.elements.angle_units import AngleUnits, mas_per_pixel
from plateviz.tables.headings import Heading
from solver.data.instrument import Instrument

OWN = "own"
NAMES: Mapping[str, str] = MappingProxyType(
    {
        "each figure's own": OWN,
        "mas": "mas",
        "µas": "µas",
        "pixel / 1000 (mpix)": "mpix",
    }
)
"""Name that a person sees -> value of `Units.unit`."""
_OF_COLUMN = re.compile(r"(?<=, )(mas|µas|mpix)$")
_OF_ROW = re.compile(r"^(mas|µas|mpix)(?=$|/)")


class Units(param.Parameterized):
    """The unit that a person has chosen; the plots and tables know nothing of it."""

    unit = param.Selector(default=OWN, objects=list(NAMES.values()), doc="of angles")

    def __init__(self, instrument: Instrument, **values: object) -> None:
        """Begin with each figure's own units; the instrument has the size of a pixel."""
        super().__init__(**values)
        self._mas_per_pixel = mas_per_pixel(instrument)

    @property
    def _chosen(self) -> AngleUnits | None:
        return None if self.unit == OWN else AngleUnits(self.unit, self._mas_per_pixel)

    def figure(self, figure: Figure | None) -> Figure | None:
        """Return a figure in the chosen unit."""
        chosen = self._chosen
        return figure if chosen is None or figure is None else chosen.figure(figure)

    def of_axes(self, figure: Figure) -> np.ndarray:
        """Return the factors from the units of the axes, x and y, to those on the screen."""
        chosen = self._chosen
        return np.array((1.0, 1.0) if chosen is None else chosen.of_axes(figure.frames[0]))

    def text(self, text: str) -> str:
        """Return a text, or markup that has no text of a person's, in the chosen unit."""
        chosen = self._chosen
        return text if chosen is None else chosen.text(text)

    def headings(self, headings: Mapping[str, Heading]) -> dict[str, Heading]:
        """Return the headings of a table in the chosen unit, as `columns` converts the columns."""
        chosen = self._chosen
        if chosen is None:
            return dict(headings)
        return {
            name: one._replace(
                title=_OF_COLUMN.sub(chosen.unit, one.title),
                group=_OF_COLUMN.sub(chosen.unit, one.group),
                format=_digits(one.format, self._factor(one)),
            )
            for name, one in headings.items()
        }

    def columns(self, table: pd.DataFrame, headings: Mapping[str, Heading]) -> pd.DataFrame:
        """Return a table whose columns of angles are in the chosen unit.

        Parameters
        ----------
        headings : of the table, in the units that its numbers have
        """
        factors = {name: self._factor(one) for name, one in headings.items()}
        return table.assign(**{n: f * table[n] for n, f in factors.items() if f != 1.0})

    def rows(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return a table whose rows have a `unit` each in the chosen unit."""
        chosen = self._chosen
        if chosen is None:
            return table
        found = [_OF_ROW.search(unit) for unit in table["unit"]]
        factors = pd.Series([1.0 if one is None else chosen.factor(one[0]) for one in found])
        numbers = table.select_dtypes("number").drop(columns="pull", errors="ignore")
        scaled = numbers.mul(factors.to_numpy(), axis=0)
        return table.assign(unit=[_OF_ROW.sub(chosen.unit, u) for u in table["unit"]], **scaled)

    def changes(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return a table of texts, whose rows begin with a label, in the chosen unit."""
        chosen = self._chosen
        if chosen is None:
            return table
        rows = [chosen.row(*row) for row in table.itertuples(index=False)]
        return pd.DataFrame(rows, columns=table.columns)

    def _factor(self, heading: Heading) -> float:
        found = _OF_COLUMN.search(heading.group) or _OF_COLUMN.search(heading.title)
        chosen = self._chosen
        return 1.0 if found is None or chosen is None else chosen.factor(found[0])


def _digits(form: str, factor: float) -> str:
    """Return a format without decimals where numbers have become a thousand times as large."""
    whole, _, decimals = form.partition(".")
    return whole if decimals and factor > 100.0 else form
