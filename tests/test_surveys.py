"""The campaigns of runs: their trials, what positions are moved by, and the table of a run."""

import numpy as np
import pytest

from solver.model.directions import mean_direction, places_about
from solver.simulate.defects.text import parse_defects
from solver.simulate.settings import SurveySettings
from tests.campaigns import surveys, zonal_errors
from tests.campaigns.surveys import CLEAN, RIGHT, Trial


@pytest.mark.parametrize("defect", RIGHT)
def test_every_defect_exists_and_has_a_folder_of_its_own(defect, tmp_path):
    assert len(parse_defects([defect])) == 1
    folder = Trial(defect, 1).folder(tmp_path)
    assert folder.parent == tmp_path
    assert folder != Trial(CLEAN, 1).folder(tmp_path)


def test_common_motions_are_what_no_star_can_show():
    random = np.random.default_rng(1)
    at = np.array([266.0, -29.0]) + random.uniform(-0.5, 0.5, (50, 2))
    east, north = places_about(mean_direction(*at.T), *at.T).T
    columns = zonal_errors.common_motions(at)

    def share_left(moved, count):
        used, flat = columns[:, :count], np.stack(moved).ravel()
        left = flat - used @ np.linalg.lstsq(used, flat)[0]
        return np.sqrt(np.mean(left**2) / np.mean(flat**2))

    # A shift, a scale and a turn about another centre.
    alike = 0.3 + 0.2 * east - 0.1 * north, -0.4 + 0.2 * north + 0.1 * east
    assert share_left(alike, 4) < 1e-12
    sheared = 0.2 * east + 0.1 * north, 0.1 * east - 0.2 * north
    assert share_left(sheared, 4) > 0.9
    assert share_left(sheared, 6) < 1e-12
    assert share_left((east**2 - north**2, 2.0 * east * north), 6) > 0.5


@pytest.mark.slow
def test_run_is_kept_as_tables_and_judged_from_them(tmp_path, monkeypatch):
    monkeypatch.setattr(surveys, "MANY_ORBITS", 2)
    # As `small_survey`, whose fits are compiled for other tests, too.
    settings = SurveySettings(orbits=2).scaled(4000)
    trials = [Trial(CLEAN, 3), Trial("focal-anisotropy=20ppm", 3)]
    for trial in trials:
        surveys.fit(trial.settings(settings), trial.folder(tmp_path))
    clean, flawed = (surveys.judge(trial, tmp_path) for trial in trials)
    assert clean.state == "good"
    assert flawed.state != "good"
    assert any("anisotropy" in cause.name for cause in flawed.causes)
    assert surveys.shift(trials[0], tmp_path) == 0.0
    assert surveys.shift(trials[1], tmp_path) > 0.0
    lines = surveys.table(trials, tmp_path).splitlines()
    assert "none" in lines[-2]
    assert lines[-1].startswith("| `focal-anisotropy=20ppm` |")
