"""Journal: the solutions that a session has made, which are there again after a reload."""

import secrets

import param

from plateviz.dashboard.solution import Solution
from plateviz.solving.made_solutions import KEY, MadeSolution, MadeSolutions


class Journal(param.Parameterized):
    """The solutions of one session, of all its orbits, in the order in which they were made."""

    made = param.List(default=[], item_type=MadeSolution)

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
            for made in self.made:
                self._store.remember(key, made)
            self._key = key
            self.made = self._store.of(key)

    def add(self, solution: Solution) -> None:
        """Remember a solution, unless it is on disk, or the next what-if replaces it."""
        if not (solution.run or solution.kept or solution.is_what_if):
            self.rename(MadeSolution(solution.orbit, solution.settings, solution.is_step), "")

    def rename(self, made: MadeSolution, name: str) -> None:
        """Give a solution of the session a name."""
        self._store.remember(self._key, made._replace(name=name))
        self.made = self._store.of(self._key)
