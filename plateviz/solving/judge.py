"""Judge: verdicts on the solutions that pages show, made elsewhere, once for all pages."""

from concurrent.futures import Executor, Future
from contextlib import suppress
from weakref import finalize

from plateviz.runs.scratch_result import is_judged_later
from plateviz.verdict.verdict import is_judged, orbit_verdict
from solver.data.result import FitResult


class Judge:
    """Judges solutions that come without a verdict, such as those of older versions."""

    def __init__(self, executor: Executor) -> None:
        """Begin without a solution.

        Parameters
        ----------
        executor : runs what takes a while
        """
        self._executor = executor
        self._begun: dict[int, Future[None]] = {}

    def has_judged(self, result: FitResult) -> bool:
        """Return whether `orbit_verdict` takes no time any more; if not, somebody is at it.

        That is the solver process, if it has just made the solution, or another thread. Called
        from one thread. Of a solution that cannot be judged, `orbit_verdict` says why.
        """
        if is_judged_later(result):
            return False
        if is_judged(result):
            return True
        key = id(result)
        if key not in self._begun:
            self._begun[key] = self._executor.submit(_judge, result)
            finalize(result, self._begun.pop, key, None)
        return self._begun[key].done()


def _judge(result: FitResult) -> None:
    # What is wrong is raised again where the verdict is used; kept, it would hold the solution.
    with suppress(Exception):
        orbit_verdict(result)
