"""Surveys for the example figures of the documents: one good, the others with one defect each."""

import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from plateviz.runs.fit_survey import fit_survey
from plateviz.runs.load_tables import survey_tables
from plateviz.runs.run import Run, open_run
from plateviz.tables.survey_tables import SourceTables, SurveyTables
from solver.data.schema import MEASUREMENT
from solver.data.settings import FitSettings
from solver.io.survey import measurement_path, read_survey_table, write_survey_table
from solver.io.survey_manifest import MANIFEST
from solver.simulate.catalogue import reference_catalogue, truth_catalogue
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

# The fields move less than the paper's, so that many sources are measured in nearly every orbit.
_SKY = replace(
    SurveySettings(orbits=48, seed=5).scaled(5_000), n_artificial=60, pair_spread_deg=0.15
)
_WIDE = SurveySettings(orbits=24, seed=5).scaled(10_000)
_WANDERING = replace(_SKY, pair_spread_deg=1.0)
_FULL_SKY = SurveySettings(seed=5).scaled(30_000)
_POSITION_ERRORS = ("ra_error", "dec_error", "pmra_error", "pmdec_error")


@dataclass(frozen=True)
class Surveys:
    """The surveys in a folder, each simulated and fitted on first use."""

    folder: Path

    @cached_property
    def good(self) -> Run:
        """A survey fitted with the true order of its distortion."""
        return _fitted(self._simulated("good", _SKY), "default", FitSettings())

    @cached_property
    def low_order(self) -> Run:
        """The same survey fitted with an order that is too low."""
        return _fitted(self.good.survey, "low", FitSettings(order=3))

    @cached_property
    def high_order(self) -> Run:
        """The same survey fitted with an order that is higher than needed."""
        return _fitted(self.good.survey, "high", FitSettings(order=6))

    @cached_property
    def ageing(self) -> Run:
        """The same survey with measurement errors that grow with time, but not as stated."""
        directory = self.folder / "ageing"
        # Without the manifest, since its measurements are to be changed.
        left_out = shutil.ignore_patterns("runs", MANIFEST)
        shutil.copytree(self.good.survey, directory, ignore=left_out)
        random = np.random.default_rng(4)
        for orbit in range(_SKY.orbits):
            _make_noisy(measurement_path(directory, orbit), 0.01 * orbit, random)
        return _fitted(directory, "default", FitSettings())

    @cached_property
    def trending(self) -> Run:
        """The same survey with a distortion that changes from orbit to orbit."""
        settings = replace(_SKY, defects=("distortion-trend=0.3um",))
        return _fitted(self._simulated("trending", settings), "default", FitSettings())

    @cached_property
    def wide(self) -> Run:
        """A survey whose fields move as far as the paper's."""
        return _fitted(self._simulated("wide", _WIDE), "default", FitSettings())

    @cached_property
    def zonal(self) -> Run:
        """The same survey with a catalogue whose errors neighbouring stars share."""
        settings = replace(_WIDE, defects=("zonal-errors=1mas",))
        return _fitted(self._simulated("zonal", settings), "default", FitSettings())

    def counted(self, settings: SurveySettings) -> SurveyTables:
        """Return a survey with the numbers of orbits of its sources, without a fit."""
        directory = self._simulated("counted", settings)
        catalogue = reference_catalogue(truth_catalogue(settings), settings)
        frames = [
            pd.read_parquet(path, columns=["source_id", "orbit_id"]).drop_duplicates()
            for path in sorted((directory / "measurements").iterdir())
        ]
        counts = pd.concat(frames).groupby("source_id").size().rename("n_orbits")
        return SurveyTables(pd.DataFrame(), catalogue.merge(counts, on="source_id"), catalogue)

    def _simulated(self, name: str, settings: SurveySettings) -> Path:
        simulate_survey(self.folder / name, settings)
        return self.folder / name


@contextmanager
def surveys() -> Iterator[Surveys]:
    """Yield the surveys, and remove their files at the end."""
    with TemporaryDirectory() as folder:
        yield Surveys(Path(folder))


def _fitted(directory: Path, name: str, settings: FitSettings) -> Run:
    fit_survey(directory, name, settings, workers=1)
    return open_run(directory, name)


def _make_noisy(path: Path, share: float, random: np.random.Generator) -> None:
    rows = read_survey_table(path, MEASUREMENT)
    for axis in "xy":
        extra = np.sqrt((1.0 + share) ** 2 - 1.0) * rows[f"s{axis}"]
        rows[f"n{axis}"] += extra * random.standard_normal(len(rows))
    write_survey_table(rows, MEASUREMENT, path)


def _sky(spoil: Callable[[pd.DataFrame], None] = lambda _: None) -> SurveyTables:
    truth = truth_catalogue(_FULL_SKY)
    catalogue = reference_catalogue(truth, _FULL_SKY)
    spoil(catalogue)
    area = _FULL_SKY.field_l_deg, _FULL_SKY.field_b_deg
    nothing = pd.DataFrame()
    return SurveyTables(nothing, nothing, catalogue, truth, None, area, _FULL_SKY.target_deg)


def _half_the_references(catalogue: pd.DataFrame) -> None:
    """Drop the reference sources in one half of the sky."""
    catalogue["is_reference"] &= catalogue["ra"] > catalogue["ra"].median()


def _overconfident(catalogue: pd.DataFrame) -> None:
    """State the errors of the reference sources three times too small."""
    references = catalogue["is_reference"]
    for name in _POSITION_ERRORS:
        catalogue.loc[references, name] /= 3.0


def _source(run: Run) -> SourceTables:
    motions = run.motions()
    often = motions[motions["is_artificial"]].nlargest(1, "n_orbits")
    chosen = int(often["source_id"].iloc[0])
    return SourceTables(run.history(chosen), run.motion(chosen))


def _compared(run: Run, other: Run) -> SurveyTables:
    return replace(survey_tables(run), other=survey_tables(other))


SurveyPair = tuple[Callable[[Surveys], SurveyTables], Callable[[Surveys], SurveyTables]]
SourcePair = tuple[Callable[[Surveys], SourceTables], Callable[[Surveys], SourceTables]]
_RUNS: SurveyPair = (lambda s: survey_tables(s.good), lambda s: survey_tables(s.low_order))
_SOURCES: SourcePair = (lambda s: _source(s.good), lambda s: _source(s.low_order))

SURVEYS: Mapping[str, SurveyPair] = {
    "orbit-health": (_RUNS[0], lambda s: survey_tables(s.ageing)),
    "sky-distribution": (lambda _: _sky(), lambda _: _sky(_half_the_references)),
    "prior-separation": (lambda _: _sky(), lambda _: _sky(_overconfident)),
    "zonal-errors": (lambda s: survey_tables(s.wide), lambda s: survey_tables(s.zonal)),
    "orbit-counts": (_RUNS[0], lambda s: s.counted(_WANDERING)),
    "error-by-count": _RUNS,
    "reference-scatter": _RUNS,
    "motion-pulls": _RUNS,
    "calibration-trends": (_RUNS[0], lambda s: survey_tables(s.trending)),
    "motion-differences": (
        lambda s: _compared(s.high_order, s.good),
        lambda s: _compared(s.low_order, s.good),
    ),
}
SOURCES: Mapping[str, SourcePair] = {"sky-track": _SOURCES, "time-series": _SOURCES}
