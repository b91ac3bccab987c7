"""LazySolver: the solution store of one origin; its solver process starts on first use."""

import weakref
from contextlib import suppress
from dataclasses import replace
from types import TracebackType
from typing import Self

from plateviz.notebook.progress import reporting
from plateviz.solving.job import Job
from plateviz.solving.origin import Origin
from plateviz.solving.solution_store import SolutionStore
from plateviz.solving.solver_queue import SolverQueue
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.errors import FitError


class LazySolver:
    """Solves orbits of one origin; the process ends with this object or the interpreter."""

    def __init__(self, origin: Origin) -> None:
        """Set the origin; nothing is started yet."""
        self.origin = origin
        # Holds the store once it is started; the finalizer must not refer to this object.
        self._started: list[SolutionStore] = []
        weakref.finalize(self, _close, self._started)

    @property
    def store(self) -> SolutionStore:
        """The solution store; the first access starts the solver process."""
        if not self._started:
            self._started.append(_start_store(self.origin))
        return self._started[0]

    def solve(
        self, orbit: int | None, settings: FitSettings, *, what_if: bool, title: str
    ) -> FitResult:
        """Return an orbit solved with `settings`, with a line of progress.

        Parameters
        ----------
        orbit : orbit_id; None if the origin is files with one orbit only
        what_if : whether a step from the last fit is enough
        title : text of the line of progress

        Raises
        ------
        InputError
            If the settings do not apply to the data.
        FitError
            If there is no solution.
        """
        store = self.store
        job = store.request(orbit, settings, what_if)
        with reporting(title) as reporter:
            try:
                reporter.follow(job)
            except KeyboardInterrupt:
                store.cancel(job)
                raise
            job.require_done()
        result = store.result(orbit, settings, what_if)
        if result is None:
            raise FitError(f"{title}: expected the result of the fit, found that it was removed")
        # All of it is read: what is read later would go with the solver.
        return replace(result)

    def close(self) -> None:
        """End the solver process; the next fit starts another."""
        _close(self._started)


class HasSolver:
    """An object that fits with a lazy solver; as a context manager it closes the solver."""

    def __init__(self, solver: LazySolver) -> None:
        """Set the solver."""
        self._solver = solver

    def close(self) -> None:
        """End the solver process; solutions remain available, and the next fit starts another."""
        self._solver.close()

    def __enter__(self) -> Self:
        """Return the object itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the solver."""
        self.close()


def run_job(job: Job, title: str) -> None:
    """Run one job in a separate solver process, with a line of progress.

    Raises
    ------
    InputError
        If the input of the job is invalid.
    FitError
        If the job failed for another reason.
    """
    solver = SolverQueue()
    try:
        with reporting(title) as reporter:
            reporter.follow(solver.submit(job))
            job.require_done()
    finally:
        solver.close()


def _start_store(origin: Origin) -> SolutionStore:
    solver = SolverQueue()
    try:
        return SolutionStore(origin, solver)
    except (OSError, ValueError):
        solver.close()
        raise


def _close(stores: list[SolutionStore]) -> None:
    while stores:
        with suppress(OSError):
            stores.pop().close()
