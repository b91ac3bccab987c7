"""Report: the content of one report file, independent of HTML."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import pandas as pd

from plateviz.figures.figure import Figure
from plateviz.tables import SummaryItem
from plateviz.verdict.verdict import Verdict

Facts = dict[str, dict[str, str]]
"""Provenance of a report: title -> name -> value."""

SOLVED = "Versions that solved it"
"""Title of the facts with the versions that made the solution."""

Plot = Callable[[], Figure]
"""Function that returns a figure."""


class Link(NamedTuple):
    """A link to another page, in a report or in a cell of its tables."""

    text: str
    target: str


@dataclass(frozen=True)
class ReportFigure:
    """One figure of a report.

    Attributes
    ----------
    name : short and unique in the report
    title, caption : displayed text
    choices : label -> function that returns the figure; a reader selects one if there are several
    is_wide : whether it takes the whole width of the page
    """

    name: str
    title: str
    caption: str
    choices: dict[str, Plot]
    is_wide: bool = False


@dataclass(frozen=True)
class Report:
    """The content of one file, in the order of the attributes.

    Attributes
    ----------
    title : name of the orbit, source or survey
    subtitle : short description
    verdict : whether to trust the solution
    items : the numbers by which it is judged
    figures : every figure
    tables : title -> values
    facts : settings, versions, hashes of the inputs, the command
    links : to other pages of the same folder
    """

    title: str
    subtitle: str
    verdict: Verdict
    items: list[SummaryItem]
    figures: list[ReportFigure]
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    facts: Facts = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)


def plain(values: Mapping[str, object]) -> dict[str, str]:
    """Return settings or other plain values as facts: text unchanged, other values as JSON."""
    return {
        name: value if isinstance(value, str) else json.dumps(value)
        for name, value in values.items()
    }
