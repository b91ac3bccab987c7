"""Report: what one file says, before it is HTML."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import holoviews as hv
import pandas as pd

from plateviz.tables import SummaryItem
from plateviz.tables.verdict import Verdict

Facts = dict[str, dict[str, str]]
"""What is known beside the solution: title -> name -> value."""

SOLVED = "Versions that solved it"
"""The title under which facts say that."""

Draw = Callable[[str], hv.core.Dimensioned]
"""Gives a picture in a theme."""


class Link(NamedTuple):
    """Words that lead to another page; in a report or in a cell of its tables."""

    words: str
    target: str


@dataclass(frozen=True)
class Picture:
    """One figure of a report.

    Attributes
    ----------
    name : short and unique in the report
    title, caption : for people
    choices : words -> what to draw; a reader chooses where there are several
    is_wide : whether it takes the whole width of the page
    """

    name: str
    title: str
    caption: str
    choices: dict[str, Draw]
    is_wide: bool = False


@dataclass(frozen=True)
class Report:
    """What one file says, in the order of the attributes.

    Attributes
    ----------
    title : of what it is
    subtitle : what it was made from, in words
    verdict : whether to trust it
    items : the numbers to judge it by
    pictures : every figure
    tables : title -> values
    facts : settings, versions, hashes of the inputs, the command
    links : to other pages of the same folder
    """

    title: str
    subtitle: str
    verdict: Verdict
    items: list[SummaryItem]
    pictures: list[Picture]
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    facts: Facts = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)


def plain(values: Mapping[str, object]) -> dict[str, str]:
    """Return settings or other plain values as facts: text as it is, all else as JSON."""
    return {
        name: value if isinstance(value, str) else json.dumps(value)
        for name, value in values.items()
    }
