"""The runs of a survey that a page knows, and those that begin while it is open."""

from contextlib import suppress

from plateviz.runs.run import Run
from plateviz.solving.solution_store import SolutionStore
from solver.errors import InputError


class KnownRuns(dict[str, Run]):
    """Name -> run, in the order of the store; a run that is removed stays known."""

    def __init__(self, store: SolutionStore) -> None:
        """Know the runs that the store has now."""
        super().__init__()
        self._store = store
        self.look()

    @property
    def first(self) -> Run | None:
        """The first whole run, or else the first one; None if there is none."""
        runs = list(self.values())
        return next((run for run in runs if run.is_complete), runs[0] if runs else None)

    def look(self) -> bool:
        """Look for runs that have begun by now; return whether there are some."""
        found: list[Run] = []
        with suppress(InputError, OSError):
            found = self._store.runs()
        if all(run.name in self for run in found):
            return False
        # What has been read of a known run stays with it.
        merged = {run.name: self.get(run.name, run) for run in found}
        merged |= {name: run for name, run in self.items() if name not in merged}
        self.clear()
        self.update(merged)
        return True
