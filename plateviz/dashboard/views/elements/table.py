"""DataTable: a table of numbers whose rows can be opened."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import pandas as pd
import panel as pn
import panel_material_ui as pmui
from bokeh.models.widgets.tables import HTMLTemplateFormatter

from plateviz.dashboard.session.units import OWN, Units
from plateviz.tables.headings import Heading
from plateviz.tables.summary import State

# The same colours as in `style.css`.
_COLOURS: Mapping[str, Mapping[State, str]] = MappingProxyType(
    {
        "light": {"good": "#187a56", "warn": "#995b00", "bad": "#c0392b"},
        "dark": {"good": "#4cc79a", "warn": "#f0b24a", "bad": "#ff8a7a"},
    }
)
# Tabulator makes its tables visible even in a hidden view; this prevents it.
TABLE_STYLE = """
:host .tabulator { font-size: 13px; visibility: inherit !important; }
/* A title above several narrow columns keeps its unit. */
:host .pnx-tabulator.tabulator .tabulator-header .tabulator-col.tabulator-col-group
> .tabulator-col-content .tabulator-col-title { white-space: normal; font-size: 11.5px; }
/* The theme has a blue on which the colours of numbers cannot be read. */
:host .pnx-tabulator.tabulator .tabulator-tableholder .tabulator-row.tabulator-selectable:hover {
  background-color: color-mix(in srgb, currentColor 12%, transparent); color: inherit; }
"""
# The table of orbits fits a window 1366 pixels wide.
_NARROW_CELLS = """
:host .pnx-tabulator.tabulator .tabulator-row .tabulator-cell,
:host .tabulator .tabulator-header .tabulator-col .tabulator-col-content {
  padding-left: 4px !important; padding-right: 4px !important; }
:host .tabulator .tabulator-header .tabulator-col.tabulator-sortable .tabulator-col-title {
  padding-right: 11px; font-size: 11.5px; }
:host .tabulator .tabulator-header .tabulator-col .tabulator-col-content .tabulator-col-sorter {
  right: 1px; }
:host .tabulator .tabulator-header .tabulator-col .tabulator-col-sorter .tabulator-arrow {
  border-left-width: 4px !important; border-right-width: 4px !important; }
/* A column without width, after the last one. */
:host .tabulator .tabulator-header .tabulator-col.empty .tabulator-col-sorter { display: none; }
"""
_NO_ROWS = "There are no rows to show yet."
# Bokeh's own formatter writes a hyphen before negative numbers, and before a zero that is rounded.
_CELL = """<%=
  value == null || Number.isNaN(value) ? "–" :
  new Intl.NumberFormat("en-US", {{
    minimumFractionDigits: {decimals}, maximumFractionDigits: {decimals}, useGrouping: {is_grouped}
  }}).format(value).replace(/^-(?=[0.,]*$)/, "").replace("-", "\u2212")
%>"""
_SHORT = """<%= value == null || Number.isNaN(value) ? "" :
  new Intl.NumberFormat("en-US", {{{digits}}}).format(value).replace("-", "\u2212") %>"""
_CLICKABLE = ".tabulator-row { cursor: pointer; }"


def number_cells(form: str) -> HTMLTemplateFormatter:
    """Return what writes numbers as `Heading.format` says, with minus signs."""
    decimals = len(form.partition(".")[2])
    template = _CELL.format(decimals=decimals, is_grouped="true" if "," in form else "false")
    return HTMLTemplateFormatter(template=template)


def short_cells(title: str) -> HTMLTemplateFormatter:
    """Return what writes numbers with as many digits as a report of their column `title` does."""
    digits = "minimumFractionDigits: 10" if "[deg]" in title else "maximumSignificantDigits: 5"
    return HTMLTemplateFormatter(template=_SHORT.format(digits=digits))


class DataTable(pn.viewable.Viewer):
    """A sortable table that reports the row that is clicked."""

    def __init__(
        self,
        headings: Mapping[str, Heading],
        on_row: Callable[[pd.Series], object] | None = None,
        *,
        page_size: int = 12,
        units: Units | None = None,
        **params: object,
    ) -> None:
        """Show the columns of `headings`.

        Parameters
        ----------
        headings : column -> its heading and format; other columns are not shown
        on_row : called with the row that is clicked
        units : of the session, in which angles are shown
        """
        super().__init__(**params)
        self._headings, self._on_row, self._page_size = headings, on_row, page_size
        self._units, self._unit = units, OWN
        self._states, self._theme = pd.DataFrame(), "light"
        self._table = self._make(headings)
        self._place = pmui.Column(self._table, margin=0)

    def __panel__(self) -> pn.viewable.Viewable:
        """Return the table."""
        return self._place

    def show(
        self, table: pd.DataFrame, theme: str = "light", states: pd.DataFrame | None = None
    ) -> None:
        """Replace the rows, in the colours of a theme; columns without values are hidden.

        Parameters
        ----------
        states : states of numbers, good to bad, with the rows and some columns of `table`
        """
        self._theme = theme
        self._states = pd.DataFrame() if states is None else states.reset_index(drop=True)
        shown = table[list(self._headings)].reset_index(drop=True)
        if self._units is not None:
            shown = self._units.columns(shown, self._headings)
            if self._units.unit != self._unit:
                # Titles of groups of columns are made with the table.
                self._unit = self._units.unit
                self._table = self._make(self._units.headings(self._headings))
                self._place[:] = [self._table]
        empty = [name for name in shown if (shown[name].isna() | (shown[name] == "")).all()]
        self._table.param.update(value=shown, hidden_columns=empty)

    def _make(self, headings: Mapping[str, Heading]) -> pn.widgets.Tabulator:
        groups: dict[str, list[str]] = {}
        for name, heading in headings.items():
            if heading.group:
                groups.setdefault(heading.group, []).append(name)
        clickable = [_CLICKABLE] if self._on_row is not None else []
        table = pn.widgets.Tabulator(
            pd.DataFrame(columns=list(headings)),
            titles={name: heading.title for name, heading in headings.items()},
            formatters={
                name: number_cells(heading.format)
                for name, heading in headings.items()
                if heading.format
            },
            text_align={name: "right" for name, heading in headings.items() if heading.format},
            groups=groups,
            disabled=True,
            show_index=False,
            selectable=False,
            configuration={"placeholder": _NO_ROWS},
            pagination="remote",
            page_size=self._page_size,
            layout="fit_data_table",
            margin=(4, 2),
            stylesheets=[TABLE_STYLE, _NARROW_CELLS, *clickable],
        )
        styler: Any = table.style
        styler.apply(self._colours, axis=None)
        table.on_click(self._open)
        return table

    def _colours(self, rows: pd.DataFrame) -> pd.DataFrame:
        # Rows arrive in the sorted order, with the index of the table.
        states = self._states.reindex(index=rows.index, columns=rows.columns)
        return states.map(lambda state: _css(state, self._theme))

    def _open(self, event: object) -> None:
        if self._on_row is not None:
            self._on_row(self._table.value.iloc[event.row])  # type: ignore[attr-defined]


def _css(state: object, theme: str) -> str:
    colour = _COLOURS[theme].get(str(state))  # type: ignore[call-overload]
    return f"color: {colour}" if colour else ""
