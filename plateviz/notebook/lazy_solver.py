"""LazySolver: the store of one source of orbits, whose solver process starts when it is needed."""

import weakref
from contextlib import suppress
from types import TracebackType
from typing import Self

from plateviz.notebook.progress import reporting
from plateviz.solving.job import Job
from plateviz.solving.origin import Origin
from plateviz.solving.solution_store import SolutionStore
from plateviz.solving.warm_solver import WarmSolver
from solver.data.result import FitResult
from solver.data.settings import FitSettings
from solver.errors import FitError


class LazySolver:
    """Solves orbits of one source; its process ends with it, or with the interpreter."""

    def __init__(self, origin: Origin) -> None:
        """Take a origin; nothing is started yet."""
        self.origin = origin
        self._open: list[SolutionStore] = []
        weakref.finalize(self, _close, self._open)

    @property
    def store(self) -> SolutionStore:
        """The store; the solver process starts with the first call."""
        if not self._open:
            self._open.append(_start_store(self.origin))
        return self._open[0]

    def solve(
        self, orbit: int | None, settings: FitSettings, *, what_if: bool, title: str
    ) -> FitResult:
        """Return an orbit solved with `settings`, with a line of progress.

        Parameters
        ----------
        orbit : of the origin, None where that is the file of one
        what_if : whether a step from the last fit will do
        title : what is being done

        Raises
        ------
        InputError
            If the data cannot hold what the settings ask for.
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
            raise FitError(f"{title}: the result is gone")
        return result

    def close(self) -> None:
        """End the solver process; a later question starts another."""
        _close(self._open)


class HasSolver:
    """An object whose fits a lazy solver runs; as a context manager it closes the solver."""

    def __init__(self, solver: LazySolver) -> None:
        """Take the solver."""
        self._solver = solver

    def close(self) -> None:
        """End the solver process; what was solved stays at hand, and a fit starts another."""
        self._solver.close()

    def __enter__(self) -> Self:
        """Return this, to be closed at the end."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close it."""
        self.close()


def run_job(job: Job, title: str) -> None:
    """Have one job done by a solver process of its own, with a line of progress.

    Raises
    ------
    InputError
        If what was asked for cannot be done.
    FitError
        If it failed otherwise.
    """
    worker = WarmSolver()
    try:
        with reporting(title) as reporter:
            reporter.follow(worker.submit(job))
            job.require_done()
    finally:
        worker.close()


def _start_store(origin: Origin) -> SolutionStore:
    worker = WarmSolver()
    try:
        return SolutionStore(origin, worker)
    except (OSError, ValueError):
        worker.close()
        raise


def _close(benches: list[SolutionStore]) -> None:
    while benches:
        with suppress(OSError):
            benches.pop().close()
