"""SurveyFigure and SourceFigure: one picture of a fitted survey, or of one of its sources.

A module of this package that defines `SURVEY_FIGURES` or `SOURCE_FIGURES` is on the Survey or
the Source page without being named anywhere else (`plateviz.gallery` finds it).
"""

from collections.abc import Callable
from dataclasses import dataclass

import holoviews as hv
import pandas as pd

from plateviz.plots.style import Limits


@dataclass(frozen=True)
class SurveyTables:
    """What a picture of a survey is drawn from.

    Attributes
    ----------
    orbits : `survey_schema.RUN_ORBITS`
    motions : `survey_schema.MOTIONS`
    catalogue : `schema.CATALOGUE`
    truth : `schema.TRUTH`, or None where there is none
    errors_by_count : as `plots.plot_error_by_count` takes it, or None without artificial sources
    area : Galactic longitudes and latitudes between which the fields lie, deg, or None
    target : Galactic longitude and latitude, deg, or None
    """

    orbits: pd.DataFrame
    motions: pd.DataFrame
    catalogue: pd.DataFrame
    truth: pd.DataFrame | None = None
    errors_by_count: pd.DataFrame | None = None
    area: tuple[Limits, Limits] | None = None
    target: tuple[float, float] | None = None


@dataclass(frozen=True)
class SourceTables:
    """What a picture of one source is drawn from.

    Attributes
    ----------
    history : rows of `survey_schema.HISTORY` of the source, in order of epoch
    motion : its row of `survey_schema.MOTIONS`, or None
    """

    history: pd.DataFrame
    motion: pd.Series | None = None


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
