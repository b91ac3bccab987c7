"""SolutionStore: one origin, one solver process, and all solutions made so far.

It belongs to the server and is shared by all its sessions. Solutions are files in a scratch
folder, named after the orbit and the settings. The folder of a killed server is removed by the
next one.
"""

import hashlib
import json
import threading
from functools import lru_cache
from pathlib import Path

from plateviz.runs.fitted_orbit import is_complete, read_fitted_orbit
from plateviz.runs.kept_solutions import KeptSolution, KeptSolutions
from plateviz.runs.queries import SurveyRun, survey_runs
from plateviz.solving.job import Job, JobStatus
from plateviz.solving.made_solutions import MadeSolution, MadeSolutions
from plateviz.solving.origin import Origin, SurveyFolder, origin_to_dict
from plateviz.solving.solver_queue import SolverQueue
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.data.settings import ENGINES, FitSettings
from solver.errors import InputError
from solver.io.disk import writing
from solver.io.scratch import ScratchFolder, temporary_folder


class SolutionStore:
    """Fits orbits of one origin on request and keeps the solutions.

    Attributes
    ----------
    origin : of the orbits
    orbits : their ids
    instrument : that took them
    kept : solutions that people have kept on disk
    made : which solutions each browser session has made
    """

    def __init__(self, origin: Origin, solver: SolverQueue) -> None:
        """Solve orbits of `origin` with `solver`, which is closed with the store."""
        self.origin = origin
        self.orbits = origin.orbits()
        self.instrument: Instrument = origin.read_instrument()
        self.kept = KeptSolutions(origin.solutions)
        self.made = MadeSolutions()
        self._solver = solver
        self._lock = threading.Lock()
        self._jobs: dict[Path, Job] = {}
        temporary = temporary_folder()
        with writing(temporary, "to make a folder for the solutions"):
            self._folder = ScratchFolder(temporary, "plateviz")
        self._scratch = self._folder.path
        self._read = lru_cache(maxsize=16)(read_fitted_orbit)

    @property
    def title(self) -> str:
        """Name of the origin."""
        return self.origin.title

    def runs(self) -> list[SurveyRun]:
        """Return the current runs of the survey; none if the origin is files."""
        origin = self.origin
        return survey_runs(Path(origin.directory)) if isinstance(origin, SurveyFolder) else []

    def request(self, orbit: int | None, settings: FitSettings, what_if: bool = False) -> Job:
        """Request an orbit fitted with `settings`; the same request returns the same job.

        Parameters
        ----------
        what_if : whether a step from the last fit is enough, where it is valid
        """
        directory = self._directory(orbit, settings, what_if)
        with self._lock:
            job = self._jobs.get(directory)
            if job is None or job.status in (JobStatus.FAILED, JobStatus.CANCELLED):
                job = self._solver.submit(Job(self._request(orbit, settings, what_if, directory)))
                self._jobs[directory] = job
            return job

    def prepare(self, orbit: int | None, settings: FitSettings) -> None:
        """Let the solver, once it is idle, fit what the what-ifs of a solution start from.

        A solution of a run was fitted by another process, which has ended. Only the first engine
        answers what-ifs.
        """
        if settings.engine == ENGINES[0]:
            self._solver.prepare(self._fit_of(orbit, settings))

    def cancel(self, job: Job) -> None:
        """Cancel a waiting or running job."""
        self._solver.cancel(job)

    def result(
        self, orbit: int | None, settings: FitSettings, what_if: bool = False
    ) -> FitResult | None:
        """Return a solution that was requested before and is complete, else None."""
        directory = self._directory(orbit, settings, what_if)
        return self._read(directory) if is_complete(directory) else None

    def keep(self, made: MadeSolution, name: str) -> KeptSolution:
        """Keep a solution on disk under a name.

        Raises
        ------
        InputError
            If the solution is no longer there, the name is not valid or not free, or the disk
            takes no file.
        """
        directory = self._directory(*made[:3])
        if not is_complete(directory):
            raise InputError("expected a solution of this server, found that it was removed")
        return self.kept.keep(name, made.orbit, made.is_step, directory)

    def close(self) -> None:
        """End the solver process and remove the scratch folder."""
        self._solver.close()
        self._folder.close()

    def _request(
        self, orbit: int | None, settings: FitSettings, what_if: bool, directory: Path
    ) -> dict[str, object]:
        fit = self._fit_of(orbit, settings)
        return {"do": "fit", **fit, "what_if": what_if, "directory": str(directory)}

    def _fit_of(self, orbit: int | None, settings: FitSettings) -> dict[str, object]:
        origin = origin_to_dict(self.origin)
        return {"origin": origin, "orbit": orbit, "settings": settings.to_dict()}

    def _directory(self, orbit: int | None, settings: FitSettings, what_if: bool) -> Path:
        request = json.dumps([orbit, settings.to_dict(), what_if], sort_keys=True)
        name = hashlib.sha256(request.encode()).hexdigest()[:16]
        return self._scratch / f"orbit={'file' if orbit is None else f'{orbit:04d}'}-{name}"
