"""The demonstration: a small survey, simulated once and kept in the user's cache."""

from pathlib import Path

from plateviz.cache import cache_directory
from plateviz.solving.job import Job
from plateviz.solving.origin import SurveyFolder
from plateviz.solving.solution_store import SolutionStore
from plateviz.solving.warm_solver import WarmSolver
from solver.data.settings import FitSettings
from solver.io.survey import HEADER
from solver.simulate.settings import SurveySettings

# Large enough for every picture to be full, small enough to be ready in half a minute.
DEMO = SurveySettings(orbits=3, seed=0).scaled(18_000)


def demo_directory() -> Path:
    """Return where the demonstration's survey is kept."""
    return cache_directory() / "demo-survey-1"


def simulation(directory: Path) -> Job | None:
    """Return the job that makes the survey, or None where it has been made."""
    if (directory / HEADER).is_file():
        return None
    directory.parent.mkdir(parents=True, exist_ok=True)
    return Job({"do": "simulate", "directory": str(directory), "settings": DEMO.to_dict()})


def open_survey(directory: Path, worker: WarmSolver) -> tuple[SolutionStore, Job]:
    """Return the store of a survey, and the job of its first orbit; all are asked for."""
    store = SolutionStore(SurveyFolder(str(directory)), worker)
    jobs = [store.request(orbit, FitSettings()) for orbit in store.orbits]
    return store, jobs[0]
