"""Journal: the solutions that a session has made, which are there again after a reload."""

import secrets
from collections.abc import Callable
from weakref import WeakMethod

import param

from plateviz.dashboard.session.solution import Request, Solution
from plateviz.solving.job import Job
from plateviz.solving.made_solutions import KEY, Awaited, MadeSolution, MadeSolutions


class Journal(param.Parameterized):
    """The solutions of one session, of all its orbits, in the order in which they were made.

    `awaited` is what the page had asked for last before it was loaded again, until the session
    takes it up.
    """

    made = param.List(default=[], item_type=MadeSolution)
    awaited = param.ClassSelector(class_=Awaited, default=None, allow_None=True)

    def __init__(self, store: MadeSolutions) -> None:
        """Begin without a solution, under a key of its own."""
        super().__init__()
        self._store, self._key = store, secrets.token_hex(16)

    def resume(self, key: str) -> None:
        """Continue the session of a browser, whose page was loaded again.

        Parameters
        ----------
        key : of the browser session, as `made_solutions.KEY`; any other is ignored
        """
        if KEY.fullmatch(key) and key != self._key:
            awaited = next(reversed(self._store.awaited(key)), None)
            self._store.move(self._key, key)
            self._key = key
            self.look()
            self.awaited = awaited

    def look(self) -> None:
        """Take over what has become complete while no page waited for it."""
        self.made = self._store.of(self._key)

    def expect(self, request: Request, job: Job, let_go: Callable[[], object]) -> None:
        """Remember that a solution is asked for, so that it is found after a reload.

        Parameters
        ----------
        let_go : method that lets the session hold the job no longer
        """
        awaited = Awaited(MadeSolution(*request), job, WeakMethod(let_go))
        self._store.expect(self._key, awaited)

    def let_others_go(self, job: Job, let_go: Callable[[], object]) -> None:
        """Let all sessions of the browser's tab but one hold a job no longer.

        Parameters
        ----------
        let_go : method of the one, as of `expect`
        """
        for one in self._store.awaited(self._key):
            other = one.let_go()
            if one.job is job and other is not None and other != let_go:
                other()

    def forget(self, job: Job) -> None:
        """Expect a job no longer, which is over or given up."""
        self._store.forget(self._key, job)

    def add(self, solution: Solution) -> None:
        """Remember a solution, unless it is on disk, or the next what-if replaces it."""
        if not (solution.run or solution.kept or solution.is_replaceable):
            self.rename(_made(solution), "")

    def rename(self, made: MadeSolution, name: str) -> None:
        """Give a solution of the session a name."""
        self._store.remember(self._key, made._replace(name=name))
        self.look()

    def label(self, solution: Solution) -> str:
        """Return the label of a solution, after the name that a person has given it."""
        if solution.run or solution.kept:
            # It was not made in this session, even if one with its settings was.
            return solution.label
        name = next((one.name for one in self.made if one.is_of(_made(solution))), "")
        return f"{name}: {solution.label}" if name else solution.label


def _made(solution: Solution) -> MadeSolution:
    return MadeSolution(solution.orbit, solution.settings, solution.is_what_if)
