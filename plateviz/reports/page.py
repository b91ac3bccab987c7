"""The page of a report: one self-contained HTML file."""

import json
import math
from collections.abc import Callable
from datetime import UTC, datetime
from functools import cache
from importlib.resources import files

import pandas as pd
from bokeh.resources import Resources
from jinja2 import Environment, PackageLoader, StrictUndefined

from plateviz.reports.figure import dark_colours, packed_document
from plateviz.reports.report import Link, Report, ReportFigure
from plateviz.reports.summary_strip import STYLE, strip
from plateviz.tables.rounded import with_minus_signs

_FOLDER = files("plateviz.reports")


def page_of(
    report: Report,
    progress: Callable[[int, int], None] = lambda *_: None,
    made: datetime | None = None,
) -> str:
    """Return a report as HTML.

    Parameters
    ----------
    progress : called with the number of figures drawn, and of all figures
    made : the time stamp, now by default; pages of the same report differ in this only
    """
    figures = []
    for done, figure in enumerate(report.figures, start=1):
        figures.append(_drawn(figure))
        progress(done, len(report.figures))
    stamp = (made or datetime.now(UTC)).strftime("%Y-%m-%d %H:%M:%S UTC")
    return (
        _environment()
        .get_template("page.html")
        .render(
            report=report,
            made=stamp,
            figures=figures,
            tables={title: _rows(table) for title, table in report.tables.items()},
            numbers=strip(report.items),
            style=STYLE + _text("page.css"),
            script=_text("page.js"),
            bokeh=_bokeh(),
            colours=json.dumps(dark_colours()),
        )
    )


def _drawn(figure: ReportFigure) -> dict[str, object]:
    documents = {label: packed_document(plot()) for label, plot in figure.choices.items()}
    return {"figure": figure, "documents": documents}


def _rows(table: pd.DataFrame) -> list[list[str | Link]]:
    return [list(map(_cell, table.columns, row)) for row in table.itertuples(index=False)]


def _cell(title: str, value: object) -> str | Link:
    """Return a value as displayed text; empty for NaN."""
    if not isinstance(value, float):
        return value if isinstance(value, Link) else str(value)
    # Coordinates need ten decimals to resolve a microarcsecond; other numbers five digits.
    if math.isnan(value):
        return ""
    return with_minus_signs(f"{value:.10f}" if "[deg]" in title else f"{value:,.5g}")


def _text(name: str) -> str:
    return (_FOLDER / name).read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("plateviz.reports", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


@cache
def _bokeh() -> str:
    """Return BokehJS without its parts for widgets, tables and formulas."""
    script = Resources(mode="inline", components=["bokeh"], minified=True).js_raw[0]
    # An inline script must not contain its end tag.
    return script.replace("</script", "<\\/script")
