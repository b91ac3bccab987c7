"""The demonstration: a small survey through all seasons, kept in the user's cache.

The survey is simulated before the dashboard opens, and its first orbit is fitted while the page
loads. A second solver process then fits all orbits, while the first one answers what-ifs.
"""

import hashlib
import json
import threading
from pathlib import Path

import typer

from plateviz.cache import cache_directory
from plateviz.runs.new_run import PACKAGES, begin_run
from plateviz.runs.run_directory import DEFAULT_RUN, RunDirectory
from plateviz.solving.job import Job, JobStatus
from plateviz.solving.progress import Reporter, reporting
from plateviz.solving.solution_store import SolutionStore
from plateviz.solving.solver_queue import SolverQueue
from solver.data.settings import FitSettings
from solver.io.disk import writing
from solver.io.lock import locked
from solver.io.survey_header import HEADER
from solver.runtime.threads import count_cores
from solver.runtime.versions import versions_of
from solver.simulate.settings import SurveySettings

# Nine orbits in each of the six seasons, so that every figure of the Survey page has data, some
# of which ask for sources seen in 40 orbits. Fitted in a minute on one core.
DEMO = SurveySettings(orbits=54, seed=0).scaled(12_000)

# The dashboard and its solver go first.
_NICENESS = 10
_MOST_WORKERS = 4
_PATIENCE_SECONDS = 5.0


def demo_directory() -> Path:
    """Return where the demonstration's survey is kept: a folder for each choice and version."""
    choice = json.dumps([DEMO.to_dict(), versions_of(PACKAGES)], sort_keys=True)
    digest = hashlib.sha256(choice.encode()).hexdigest()[:12]
    # The page's title is the name of the survey's folder.
    return cache_directory() / f"demo-{digest}" / "demo"


def make_survey(directory: Path, solver: SolverQueue, reporter: Reporter) -> RunDirectory:
    """Simulate the survey and begin its run, unless they are there; the run, complete or not.

    Of two processes that do so at once, the second waits and finds them.
    """
    with writing(directory, "to make the folder"):
        directory.mkdir(parents=True, exist_ok=True)
    # Simulating locks the directory itself.
    with locked(directory.parent, wait=True):
        if not (directory / HEADER).is_file():
            request = {"do": "simulate", "directory": str(directory), "settings": DEMO.to_dict()}
            _finish(solver.submit(Job(request)), reporter)
        return begin_run(directory, DEFAULT_RUN, FitSettings())


def request_first_orbit(store: SolutionStore, run: RunDirectory) -> Job | None:
    """Ask for the orbit that the page opens with; None if the run has it."""
    first = store.orbits[0]
    return None if first in run.complete_orbits() else store.request(first, FitSettings())


def _finish(job: Job, reporter: Reporter) -> None:
    reporter.follow(job)
    job.require_done()


class BackgroundFit:
    """A fit of all orbits of a run in a process of its own, which ends with this one."""

    def __init__(self, run: RunDirectory, first: Job | None) -> None:
        """Take a run, and the job of another process that is to be over before the fit starts."""
        self._run, self._first = run, first
        self._lock = threading.Lock()
        self._solver: SolverQueue | None = None
        self._is_closed = False
        self._thread = threading.Thread(target=self._fit, daemon=True)

    def start(self) -> None:
        """Fit the orbits that are missing, with a line of progress."""
        if not self._run.is_complete:
            self._thread.start()

    def close(self) -> None:
        """End the process; orbits that are whole are kept, and a later fit goes on with them."""
        with self._lock:
            self._is_closed = True
            if self._solver is not None:
                self._solver.close()
        if self._thread.is_alive():
            self._thread.join(_PATIENCE_SECONDS)

    def _fit(self) -> None:
        with reporting("fitting the first orbit") as reporter:
            if self._first is not None:
                reporter.follow(self._first)
            reporter.say("fitting orbits")
            job = self._submit()
            if job is None:
                return
            status = reporter.follow(job)
        if self._solver is not None:
            self._solver.close()
        if status is not JobStatus.CANCELLED:
            typer.echo(_outcome(job, self._run))

    def _submit(self) -> Job | None:
        """Start the process and give it its job; None where the fit was closed before."""
        with self._lock:
            if self._is_closed:
                return None
            self._solver = SolverQueue(_NICENESS)
            request = {
                "do": "survey",
                "directory": str(self._run.survey),
                "run": self._run.name,
                "settings": FitSettings().to_dict(),
                "orbits": None,
                "workers": min(max(1, count_cores() - 1), _MOST_WORKERS),
            }
            return self._solver.submit(Job(request))


def _outcome(job: Job, run: RunDirectory) -> str:
    """Return what became of a background fit that was not stopped."""
    if job.status is JobStatus.FAILED:
        return f"plateviz stopped fitting the other orbits: {job.message}"
    failures = run.failures()
    if failures:
        return f"plateviz fitted all orbits but {len(failures)}: {next(iter(failures.values()))}"
    return "plateviz has fitted all orbits: the Survey view shows them"
