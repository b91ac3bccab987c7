"""SolutionStore: one origin, one solver process, and the solutions made so far.

It belongs to the server and is shared by all its sessions. Solutions are files in a scratch
folder, named after the orbit and the settings (see `scratch_results.py`). The folder of a killed
server is removed by the next one.
"""

import hashlib
import json
import threading
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from plateviz.runs.column_cache import ColumnCache
from plateviz.runs.fitted_orbit import is_complete
from plateviz.runs.kept_selections import KeptSelections
from plateviz.runs.kept_solutions import KeptSolution, KeptSolutions
from plateviz.runs.orbit_cache import OrbitCache
from plateviz.runs.run import Run, survey_runs
from plateviz.runs.run_directory import run_directories
from plateviz.runs.scratch_result import is_written
from plateviz.solving.background import Background
from plateviz.solving.job import Job, JobStatus
from plateviz.solving.judge import Judge
from plateviz.solving.made_solutions import MadeSolution, MadeSolutions
from plateviz.solving.origin import Origin, SurveyFolder, origin_to_dict
from plateviz.solving.run_reader import RunReader
from plateviz.solving.scratch_results import ScratchResults
from plateviz.solving.solver_pool import Solver
from plateviz.solving.turns import Turns
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
    instrument : that took them
    simulation : settings with which they were simulated; None for others
    kept : solutions that people have kept on disk
    selections : selections that people have kept on disk
    made : which solutions each browser session has made
    columns : the columns of runs that were read last
    background : runs what takes a while, for all sessions
    judge : of the solutions that are shown
    run_reader : of the runs that are shown
    reports : turns of those who make a report
    """

    def __init__(self, origin: Origin, solver: Solver) -> None:
        """Solve orbits of `origin` with `solver`, which is closed with the store."""
        self.origin = origin
        self._orbits = origin.orbits()
        self.instrument: Instrument = origin.read_instrument()
        self.simulation = origin.read_simulation()
        self.kept = KeptSolutions(origin.solutions, self.instrument)
        self.selections = KeptSelections(origin.solutions)
        self.made = MadeSolutions()
        self._solver = solver
        self._lock = threading.Lock()
        # The orbit for which preparations were asked for last, unless they were given up.
        self._prepared: int | None = None
        self._jobs: dict[Path, Job] = {}
        temporary = temporary_folder()
        with writing(temporary, "to make a folder for the solutions"):
            self._folder = ScratchFolder(temporary, "plateviz")
        self._scratch = self._folder.path
        self._results = ScratchResults(self._complete)
        self._of_runs = OrbitCache()
        self.columns = ColumnCache()
        self.background = Background()
        self.judge = Judge(self.background)
        self.run_reader = RunReader(self.background)
        self.reports = Turns()

    @property
    def title(self) -> str:
        """Name of the origin."""
        return self.origin.title

    @property
    def orbits(self) -> list[int | None]:
        """The orbits that the origin has by now; those known before while it cannot be read."""
        with suppress(InputError, OSError):
            self._orbits = self.origin.orbits()
        return self._orbits

    def runs(self) -> list[Run]:
        """Return the current runs of the survey; none if the origin is files."""
        origin = self.origin
        if not isinstance(origin, SurveyFolder):
            return []
        return survey_runs(Path(origin.directory), self._of_runs)

    def request(self, orbit: int | None, settings: FitSettings, what_if: bool = False) -> Job:
        """Request an orbit fitted with `settings`; the same request returns the same job.

        Who requests a job holds it until it is over, cancelled or abandoned.

        Parameters
        ----------
        what_if : whether a step from the last fit is enough, where it is valid
        """
        directory = self._directory(orbit, settings, what_if)
        with self._lock:
            self._expect(directory)
            job = self._jobs.get(directory)
            if job is None or job.status in (JobStatus.FAILED, JobStatus.CANCELLED):
                job = Job(self._request(orbit, settings, what_if, directory))
                self._jobs[directory] = job
                if what_if and is_written(directory):
                    # It was likely to be asked for.
                    job.take({"event": "done"})
                else:
                    self._solver.submit(job)
            job.hold()
            return job

    def prepare(
        self,
        orbit: int | None,
        settings: FitSettings,
        likely: Iterable[FitSettings] = (),
        *,
        may_fit: bool = True,
        is_urgent: bool = False,
    ) -> None:
        """Let the solver, once it is idle, prepare what a person may ask for next.

        Only the first engine answers what-ifs.

        Parameters
        ----------
        settings : of the solution that the what-ifs start from
        likely : settings of what-ifs that are made, the likeliest first
        may_fit : whether to fit what they start from: a solution of a run was fitted by another
            process, which has ended
        is_urgent : whether to begin as soon as no request waits
        """
        if settings.engine != ENGINES[0]:
            return
        made = [(one, self._directory(orbit, one, what_if=True)) for one in likely]
        with self._lock:
            for _, directory in made:
                self._expect(directory)
        self._prepared = orbit
        request = {
            **self._fit_of(orbit, settings),
            "may_fit": may_fit,
            "only_fit": False,
            "is_urgent": is_urgent,
            "likely": [{"settings": one.to_dict(), "directory": str(at)} for one, at in made],
        }
        self._solver.prepare(request)

    def pause(self) -> None:
        """Let preparations wait for a moment: a page that opens needs the cores."""
        self._solver.pause()

    def leave(self, orbit: int | None) -> None:
        """Give up what is prepared for an orbit that a page leaves: the page needs the cores.

        What was asked for later, of another orbit, is not given up.
        """
        if self._prepared == orbit:
            self._prepared = None
            self._solver.rest()

    def cancel(self, job: Job) -> bool:
        """Give up a job that was requested; stop it, and return True, if nobody else holds it."""
        is_last = job.release()
        if is_last:
            self._solver.cancel(job)
        return is_last

    def abandon(self, job: Job) -> None:
        """Leave a job that was requested to those who request it next, such as a reloaded page."""
        job.release()

    def result(
        self, orbit: int | None, settings: FitSettings, what_if: bool = False
    ) -> FitResult | None:
        """Return a solution that was requested before and is there, else None.

        The eigenmodes of a what-if follow once the solver is idle or somebody asks for them.
        """
        return self._results.get(self._directory(orbit, settings, what_if))

    def has_result(self, orbit: int | None, settings: FitSettings, what_if: bool = False) -> bool:
        """Return whether a solution is there, requested or expected; it is not read for that."""
        return is_written(self._directory(orbit, settings, what_if))

    def keep(self, made: MadeSolution, name: str) -> KeptSolution:
        """Keep a solution on disk under a name.

        Raises
        ------
        InputError
            If the solution is no longer there, the name is not valid or not free, or the disk
            takes no file.
        """
        result = self.result(made.orbit, made.settings, made.is_what_if)
        if result is None:
            raise InputError(
                "expected a solution, found that it made room for others: show it first"
            )
        return self.kept.keep(name, made.orbit, made.is_what_if, result)

    def close(self) -> None:
        """End the solver process and remove the scratch folder."""
        self._of_runs.close()
        self.background.shutdown(wait=False, cancel_futures=True)
        self._solver.close()
        self._folder.close()

    def _expect(self, directory: Path) -> None:
        """Make room for a result that may be written; the lock is held."""
        for removed in self._results.expect(directory):
            self._jobs.pop(removed, None)

    def _complete(self, directory: Path, part: str) -> bool:
        """Let the solver write a part that a result lacks; return whether it is at it."""
        job = self._jobs.get(directory)
        return job is not None and self._solver.complete(job, part)

    def _request(
        self, orbit: int | None, settings: FitSettings, what_if: bool, directory: Path
    ) -> dict[str, object]:
        fit = self._fit_of(orbit, settings)
        return {"do": "fit", **fit, "what_if": what_if, "directory": str(directory)}

    def _fit_of(self, orbit: int | None, settings: FitSettings) -> dict[str, object]:
        base = None if orbit is None else self._base(orbit, settings)
        fit = {"origin": origin_to_dict(self.origin), "orbit": orbit, "base": base}
        return {**fit, "settings": settings.to_dict()}

    def _base(self, orbit: int, settings: FitSettings) -> dict[str, object] | None:
        """Return the solution of a run from which a what-if can start, for `base_of`."""
        if not isinstance(self.origin, SurveyFolder):
            return None
        for run in run_directories(Path(self.origin.directory)):
            directory = run.orbit_directory(orbit)
            # Whoever looks at a damaged run is told so.
            with suppress(InputError):
                fitted = run.settings()
                if fitted.serves(settings) and is_complete(directory):
                    return {"settings": fitted.to_dict(), "directory": str(directory)}
        return None

    def _directory(self, orbit: int | None, settings: FitSettings, what_if: bool) -> Path:
        # A solution of files that have been changed since is none of what is there now.
        state = self.origin.state(orbit)
        request = json.dumps([orbit, settings.to_dict(), what_if, state], sort_keys=True)
        name = hashlib.sha256(request.encode()).hexdigest()[:16]
        return self._scratch / f"orbit={'file' if orbit is None else f'{orbit:04d}'}-{name}"
