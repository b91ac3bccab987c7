"""Exploration: what the Explore workspace draws against what, in one browser session."""

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import param

from plateviz.dashboard.address_parts import chosen, quoted
from plateviz.plots.explore.explored_rows import ExploredColumns
from plateviz.plots.explore.explored_text import parts_of, read_parts, text_of
from solver.data.subset import KINDS

# Tables under the names that they have in addresses of older versions.
_RENAMED = {"residuals": "measurements"}
PARTS = ("rows", "x", "y", "colour", "only", "between", "with", "selects", "zoom")
"""Parts of an address."""
# A control shows an empty value as if nothing were chosen.
NONE = "none"
_OPTIONAL = ("colour", "only")
_ALL = (-math.inf, math.inf)
# What is shown first of each table, where it has these columns.
_FIRST: Mapping[str, tuple[str, str]] = {
    "measurements": ("focal_x", "residual_x"),
    "sources": ("n_obs", "sigma_ra_marginal"),
    "exposures": ("minutes", "chi2_per_dof"),
    "sources per orbit": ("epoch", "offset_ra"),
    "motions": ("n_orbits", "sigma_parallax"),
    "orbits": ("epoch", "chi2_per_dof"),
}


class Exploration(param.Parameterized):
    """A table, the columns of it that are drawn, and the limits of the axes.

    The names of the parameters are those of `ExploredColumns`.
    """

    table = param.Selector(doc="what a row is")
    x = param.Selector(doc="column along the lower axis")
    y = param.Selector(doc="column along the left axis")
    colour = param.Selector(default=NONE, objects=[NONE], doc="column that decides the colour")
    only = param.Selector(default=NONE, objects=[NONE], doc="column whose values limit the rows")
    lowest = param.Number(default=-math.inf, doc="least value of that column")
    highest = param.Number(default=math.inf, doc="largest value of that column")
    is_log_x = param.Boolean(default=False, doc="whether the lower axis is logarithmic")
    is_log_y = param.Boolean(default=False, doc="whether the left axis is logarithmic")
    has_median = param.Boolean(default=False, doc="whether medians in bins are drawn")
    selects = param.Selector(objects=[*KINDS], doc="what a drag in the picture selects")
    returns = param.Integer(default=0, doc="how often what the rows are of was gone, and came back")
    limits = param.Tuple(default=None, length=2, allow_None=True, doc="limits of the axes, or None")

    def __init__(self, tables: list[str], **values: Any) -> None:  # noqa: ANN401 as param
        """Begin with the first of the tables."""
        super().__init__(**values)
        self.param["table"].objects = tables
        self.table = tables[0]
        self._requested: dict[str, str] = {}
        self.param.watch(self._forget, ["table", "x", "y", "only", "is_log_x", "is_log_y"])

    def offer(self, columns: list[str]) -> list[str]:
        """Limit the choice to the columns of the table; a column that it lacks is replaced.

        Returns
        -------
        What an address has requested in vain, in words.
        """
        requested, self._requested = self._requested, {}
        first = [name for name in _FIRST[self.table] if name in columns] or columns[:1]
        defaults = {"x": first[0], "y": first[-1], "colour": NONE, "only": NONE}
        wanted = {name: requested.get(name, getattr(self, name)) for name in defaults}
        for name, default in defaults.items():
            options = [NONE, *columns] if name in _OPTIONAL else columns
            # A control takes the first of other options, so that the value is set after them.
            self.param[name].objects = options
            found = wanted[name] if wanted[name] in options else default
            self.param.update(**{name: found})
        problems = [
            f"{name}: expected a column of the {self.table}, found {quoted(requested[name])}"
            for name in defaults
            if name in requested and getattr(self, name) != requested[name]
        ]
        self.selects = chosen("selects", requested, KINDS, self.selects, problems)
        switches, limits, invalid = read_parts(requested)
        self.param.update(**switches)
        # Another kind of axis forgets its limits, so that they are set last.
        self.param.update(**limits)
        return problems + invalid

    def columns(self) -> ExploredColumns:
        """Return what is to be drawn."""
        values: dict[str, Any] = {
            one.name: getattr(self, one.name) for one in fields(ExploredColumns)
        }
        values |= {name: "" for name in _OPTIONAL if values[name] == NONE}
        return ExploredColumns(**values)

    def texts(self) -> list[str]:
        """Return what is to be drawn as a text of a report's option; none before it is known."""
        # It has no columns before it is drawn.
        return [] if self.x is None else [text_of(self.table, self.columns())]

    def restore(self, address: Mapping[str, str]) -> list[str]:
        """Draw what a page's address requests, once its table is there.

        Columns without a table are those of the table that is drawn.

        Returns
        -------
        Why the address names no table, in words; `offer` returns what else of it is invalid.
        """
        problems: list[str] = []
        if any(part in address for part in PARTS):
            rows = address.get("rows", self.table)
            address = {**address, "rows": _RENAMED.get(rows, rows)}
            table = chosen("rows", address, self.param["table"].objects, None, problems)
            if table is not None:
                self.table, self._requested = table, dict(address)
        return problems

    def address(self) -> dict[str, str]:
        """Return what is drawn as the query of the page's address; `restore` reads it back."""
        if self.x is None:
            return {}
        return parts_of(self.table, self.columns())

    def _forget(self, *events: param.parameterized.Event) -> None:
        """Forget limits that were of other columns."""
        names = {event.name for event in events}
        values: dict[str, object] = {} if names == {"only"} else {"limits": None}
        if names & {"table", "only"}:
            values |= dict(zip(("lowest", "highest"), _ALL, strict=True))
        self.param.update(**values)
