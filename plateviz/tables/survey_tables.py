"""SurveyTables and SourceTables: the frames from which the figures of a run are drawn."""

from dataclasses import dataclass

import pandas as pd


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
    area: tuple[tuple[float, float], tuple[float, float]] | None = None
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
