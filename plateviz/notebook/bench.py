"""Bench: the workbench of one source of orbits, whose solver process starts when it is needed."""

import weakref
from contextlib import suppress
from types import TracebackType
from typing import Self

from plateviz.job import Job
from plateviz.notebook.progress import reporting
from plateviz.source import Source
from plateviz.workbench import Workbench
from plateviz.worker import Worker
from solver.errors import FitError
from solver.result import FitResult
from solver.settings import FitSettings


class Bench:
    """Solves orbits of one source; its process ends with it, or with the interpreter."""

    def __init__(self, source: Source) -> None:
        """Take a source; nothing is started yet."""
        self.source = source
        self._open: list[Workbench] = []
        weakref.finalize(self, _close, self._open)

    @property
    def workbench(self) -> Workbench:
        """The workbench; the solver process starts with the first call."""
        if not self._open:
            self._open.append(_workbench(self.source))
        return self._open[0]

    def solve(
        self, orbit: int | None, settings: FitSettings, *, what_if: bool, title: str
    ) -> FitResult:
        """Return an orbit solved with `settings`, with a line of progress.

        Parameters
        ----------
        orbit : of the source, None where that is the file of one
        what_if : whether a step from the last fit will do
        title : what is being done

        Raises
        ------
        InputError
            If the data cannot hold what the settings ask for.
        FitError
            If there is no solution.
        """
        bench = self.workbench
        job = bench.request(orbit, settings, what_if)
        with reporting(title) as reporter:
            try:
                reporter.follow(job)
            except KeyboardInterrupt:
                bench.cancel(job)
                raise
            job.require_done()
        result = bench.result(orbit, settings, what_if)
        if result is None:
            raise FitError(f"{title}: the result is gone")
        return result

    def close(self) -> None:
        """End the solver process; a later question starts another."""
        _close(self._open)


class OnBench:
    """Something that a bench solves; as a context it closes the bench at the end."""

    def __init__(self, bench: Bench) -> None:
        """Take the bench."""
        self._bench = bench

    def close(self) -> None:
        """End the solver process; what was solved stays at hand, and a fit starts another."""
        self._bench.close()

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
    worker = Worker()
    try:
        with reporting(title) as reporter:
            reporter.follow(worker.submit(job))
            job.require_done()
    finally:
        worker.close()


def _workbench(source: Source) -> Workbench:
    worker = Worker()
    try:
        return Workbench(source, worker)
    except (OSError, ValueError):
        worker.close()
        raise


def _close(benches: list[Workbench]) -> None:
    while benches:
        with suppress(OSError):
            benches.pop().close()
