"""SurveyTables and SourceTables: input tables of the figures of a run."""

from dataclasses import dataclass, field
from functools import cached_property

import pandas as pd

from plateviz.tables.run_diagnosis import RunTests, no_tests
from plateviz.tables.source_track import source_curves, source_track


@dataclass(frozen=True)
class SurveyTables:
    """Input tables of the figures of a survey.

    Attributes
    ----------
    orbits : `survey_schema.RUN_ORBITS`
    motions : `survey_schema.MOTIONS`
    catalogue : `schema.CATALOGUE`
    truth : `schema.TRUTH`, or None
    errors_by_count : `survey_schema.ERRORS_BY_COUNT`, or None without artificial sources
    area : Galactic longitudes and latitudes between which the fields lie, deg, or None
    target : Galactic longitude and latitude, deg, or None
    tests : tables from which the run is tested
    other : of the run that this one is compared with, or None
    """

    orbits: pd.DataFrame
    motions: pd.DataFrame
    catalogue: pd.DataFrame
    truth: pd.DataFrame | None = None
    errors_by_count: pd.DataFrame | None = None
    area: tuple[tuple[float, float], tuple[float, float]] | None = None
    target: tuple[float, float] | None = None
    tests: RunTests = field(default_factory=no_tests)
    other: "SurveyTables | None" = None


@dataclass(frozen=True)
class SourceTables:
    """Input tables of the figures of one source, which share what is computed from them.

    Attributes
    ----------
    history : rows of `survey_schema.HISTORY` of the source, in order of epoch
    motion : its row of `survey_schema.MOTIONS`, or None
    """

    history: pd.DataFrame
    motion: pd.Series | None = None

    @cached_property
    def track(self) -> pd.DataFrame:
        """`tables.source_track`."""
        return source_track(self.history, self.motion)

    @cached_property
    def curves(self) -> pd.DataFrame:
        """`tables.source_curves`."""
        return source_curves(self.history, self.motion)
