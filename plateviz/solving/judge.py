"""Judge: verdicts on the solutions that pages show, made elsewhere, once for all pages."""

from concurrent.futures import Executor, Future
from contextlib import suppress
from weakref import finalize

from plateviz.runs.scratch_result import is_judged_later, request_late_verdict
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
        """Return whether `orbit_verdict` takes no time any more.

        Of a solution that cannot be judged, `orbit_verdict` says why.
        """
        if is_judged_later(result):
            return False
        begun = self._begun.get(id(result))
        return is_judged(result) or (begun is not None and begun.done())

    def request(self, result: FitResult) -> None:
        """Have a solution judged, unless it is or somebody is at it; called from one thread.

        The solver process judges what it has just made, another thread what comes from elsewhere
        or what the solver process has given up.
        """
        request_late_verdict(result)
        key = id(result)
        if not (is_judged_later(result) or is_judged(result) or key in self._begun):
            self._begun[key] = self._executor.submit(_judge, result)
            finalize(result, self._begun.pop, key, None)


def _judge(result: FitResult) -> None:
    # What is wrong is raised again where the verdict is used; kept, it would hold the solution.
    with suppress(Exception):
        orbit_verdict(result)
