"""Fixtures shared by all tests."""

from pathlib import Path

import pytest

from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def sample_orbit_dir() -> Path:
    """Folder of the sample orbit that lies beside the checkout; skips where it is absent."""
    folder = REPOSITORY.parent / "shared" / "data" / "sample-orbit"
    if not folder.is_dir():
        pytest.skip(f"no sample orbit at {folder}")
    return folder


@pytest.fixture(scope="session")
def small_survey(tmp_path_factory) -> Path:
    """A survey directory of two sparse orbits."""
    directory = tmp_path_factory.mktemp("survey") / "small"
    simulate_survey(directory, SurveySettings(orbits=2, seed=3).scaled(4000))
    return directory
