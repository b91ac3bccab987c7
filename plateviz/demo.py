"""The demonstration: a small survey, simulated once and kept in the user's cache."""

from pathlib import Path

from plateviz.cache import cache_directory
from plateviz.job import Job, JobStatus
from plateviz.source import SurveyFolder
from plateviz.workbench import Workbench
from plateviz.worker import Worker
from solver.errors import InputError
from solver.io.survey import HEADER
from solver.settings import FitSettings
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


def open_survey(directory: Path, worker: Worker) -> tuple[Workbench, Job]:
    """Return the workbench of a survey, and the job of its first orbit; all are asked for."""
    workbench = Workbench(SurveyFolder(str(directory)), worker)
    jobs = [workbench.request(orbit, FitSettings()) for orbit in workbench.orbits]
    return workbench, jobs[0]


def require_done(job: Job) -> None:
    """Raise InputError with the reason if a job did not come to its end."""
    if job.wait() is not JobStatus.DONE:
        raise InputError(job.message or f"the work was {job.status.value}")
