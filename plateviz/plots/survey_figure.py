"""SurveyFigure and SourceFigure: one picture of a fitted survey, or of one of its sources.

A module of this package that defines `SURVEY_FIGURES` or `SOURCE_FIGURES` is on the Survey or
the Source page without being named anywhere else (`plateviz.plots.gallery` finds it).
"""

from collections.abc import Callable
from dataclasses import dataclass

import holoviews as hv

from plateviz.tables.survey_tables import SourceTables, SurveyTables


@dataclass(frozen=True)
class SurveyFigure:
    """One picture of a fitted survey.

    Attributes
    ----------
    name : short and unique, used in addresses and file names
    title : for people
    caption : what it shows and what good looks like, in a sentence or two
    order : place on the page
    draw : picture of the tables, in a theme
    is_wide : whether it takes the whole width of the page
    """

    name: str
    title: str
    caption: str
    order: int
    draw: Callable[[SurveyTables, str], hv.core.Dimensioned]
    is_wide: bool = False


@dataclass(frozen=True)
class SourceFigure:
    """One picture of a source of a fitted survey; attributes as `SurveyFigure` has them."""

    name: str
    title: str
    caption: str
    order: int
    draw: Callable[[SourceTables, str], hv.core.Dimensioned]
    is_wide: bool = False
