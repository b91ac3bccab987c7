"""The paper's survey at full size; takes ten minutes and 5 GB, run with `pytest -m full`."""

import pytest

from plateviz.runs.fit_survey import fit_survey
from plateviz.runs.run import Run
from solver.data.settings import FitSettings
from solver.data.survey_schema import MOTION_PARAMETERS
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

pytestmark = [pytest.mark.full, pytest.mark.slow, pytest.mark.timeout(3600)]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    survey = tmp_path_factory.mktemp("full") / "survey"
    simulate_survey(survey, SurveySettings())
    report = fit_survey(survey, "default", FitSettings())
    assert report.run.is_complete
    return Run(report.run)


@pytest.mark.parametrize("parameter", MOTION_PARAMETERS)
def test_errors_of_motions_agree_with_their_sigmas(run, parameter):
    motions = run.motions()
    others = motions[~motions["is_reference"] & (motions["n_orbits"] >= 40)]
    assert others[f"pull_{parameter}"].std() == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("n_orbits", [10, 30, 80])
def test_errors_fall_to_the_predicted_floor(run, n_orbits):
    row = run.errors_by_count().set_index("n_orbits").loc[n_orbits]
    assert row["error_mas"] == pytest.approx(row["expected_mas"], rel=0.1)


def test_every_orbit_converges_with_the_expected_chi2(run):
    orbits = run.orbits()
    assert (orbits["converged"] == 1.0).all()
    pulls = (orbits["chi2_per_dof"] - 1.0) / (2.0 / orbits["dof"]) ** 0.5
    assert pulls.abs().max() < 4.5


def test_reference_sources_scatter_as_predicted(run):
    motions = run.motions()
    often = motions[motions["is_reference"] & (motions["n_orbits"] >= 40)]
    ratio = (often["scatter_ra"] / often["expected_scatter_ra"]) ** 2
    assert ratio.mean() == pytest.approx(1.0, abs=0.05)
