"""Fixtures shared by all tests."""

import os
from pathlib import Path

import jax
import pytest

from solver.errors import InputError
from solver.runtime.device import require_device
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

REPOSITORY = Path(__file__).resolve().parent.parent


def pytest_addoption(parser):
    parser.addoption("--device", help="what JAX computes on: cpu, cuda, ...; JAX chooses if unset")


def pytest_configure(config):
    _choose(config.getoption("--device") or os.environ.get("JAX_PLATFORMS", ""))
    # A test runs next to nothing of what it compiles. Only the CPU's compiler is known to hurry.
    jax.config.update("jax_disable_most_optimizations", jax.default_backend() == "cpu")


def _choose(device):
    if device:
        # For the processes that tests start: here JAX has been imported and does not look again.
        os.environ["JAX_PLATFORMS"] = device
        jax.config.update("jax_platforms", device)
    try:
        require_device()
    except InputError as error:
        raise pytest.UsageError(str(error)) from error


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
