"""Simulated orbits of any size, for the benchmarks."""

from dataclasses import replace

from solver.data.instrument import MINI_MOCK
from solver.data.orbit import OrbitData
from solver.simulate.catalogue import reference_catalogue, truth_catalogue
from solver.simulate.measure import measure_orbit
from solver.simulate.settings import SurveySettings

ORBIT = 0
# Numbers measured in this orbit with the paper's catalogue of 132,651 stars.
SOURCES_OF_THE_PAPER = 6480
MEASUREMENTS_OF_THE_PAPER = 247_932
EXPOSURES_OF_THE_PAPER = 96


def survey_of(sources: float, exposures: int = EXPOSURES_OF_THE_PAPER) -> SurveySettings:
    """Return the mini-mock survey, scaled to about `sources` sources and `exposures` exposures."""
    paper = SurveySettings()
    scaled = paper.scaled(round(sources / SOURCES_OF_THE_PAPER * paper.n_stars))
    return replace(scaled, orbits=1, exposures_per_field=exposures // scaled.n_fields)


def simulated_orbit(survey: SurveySettings) -> OrbitData:
    """Simulate one orbit of a survey."""
    truth = truth_catalogue(survey)
    measured = measure_orbit(ORBIT, truth, survey, MINI_MOCK)
    catalogue = reference_catalogue(truth, survey)
    return OrbitData(measured.measurements, measured.exposures, catalogue, truth)
