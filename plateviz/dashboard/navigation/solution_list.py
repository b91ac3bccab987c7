"""SolutionList: all solutions that a page can show or compare with, without Panel."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from plateviz.dashboard.navigation.navigation import Navigation
from plateviz.dashboard.selection.selected import require_visible
from plateviz.dashboard.session.solution import Request, Solution
from plateviz.dashboard.session.solution_address import read_kept, run_settings, solution_of_run
from plateviz.runs.kept_solutions import KeptSolution
from plateviz.runs.note import NOTE_FILE
from plateviz.runs.run import Run
from plateviz.solving.made_solutions import MadeSolution
from solver.errors import InputError

_DAMAGED = "damaged"


class OfRun(NamedTuple):
    """The solution of one orbit in a run."""

    run: Run
    orbit: int


class Entry(NamedTuple):
    """A solution in the list.

    Attributes
    ----------
    what : where it is
    orbit : orbit_id; None for files of one orbit
    name : that a person gave it, or of its run; may be empty
    settings : in words
    made : how it was made, and whether it is on disk
    """

    what: OfRun | KeptSolution | MadeSolution
    orbit: int | None
    name: str
    settings: str
    made: str

    @property
    def label(self) -> str:
        """The entry in a few words."""
        of_orbit = "" if self.orbit is None else f"orbit {self.orbit}: "
        named = f"{self.name}: " if self.name else ""
        return f"{of_orbit}{named}{self.settings} ({self.made})"

    @property
    def note_path(self) -> Path | None:
        """The file of the note; None for what is not on disk."""
        if isinstance(self.what, OfRun):
            return self.what.run.directory / NOTE_FILE
        return self.what.note_path if isinstance(self.what, KeptSolution) else None


class SolutionList:
    """The solutions of the session, the kept ones, and those of the runs."""

    def __init__(self, navigation: Navigation) -> None:
        """List what the page of `navigation` can show."""
        self._navigation, self._session = navigation, navigation.session

    def entries(self) -> list[Entry]:
        """Return the solutions of the session, the kept ones, and those of the orbit in runs."""
        store, orbit = self._session.store, self._session.shown_part.orbit
        what_if = self._what_if()
        made = [
            Entry(one, one.orbit, one.name, one.settings.describe(), _how(one.is_what_if))
            for one in reversed(self._session.journal.made)
        ]
        if what_if is not None:
            words = f"{_how(what_if.is_what_if)}, on the screen"
            made.insert(0, Entry(what_if, what_if.orbit, "", what_if.settings.describe(), words))
        kept = [self._of_kept(one) for one in store.kept.all()]
        runs = [self._of_run(one, orbit) for one in self._navigation.runs]
        return [*made, *kept, *(one for one in runs if one is not None)]

    def other_orbits(self) -> list[Entry]:
        """Return the other orbits of the run on the screen, whether it has them or not."""
        run, orbit = self._navigation.run, self._session.shown_part.orbit
        if run is None:
            return []
        settings = _described(run)
        others = [one for one in self._session.store.orbits if one not in (orbit, None)]
        return [Entry(OfRun(run, one), one, run.name, settings, "run") for one in others]

    def load(self, entry: Entry) -> Solution | Request:
        """Return a solution of the list, or a request if it has to be computed again.

        Raises
        ------
        InputError
            If it cannot be read.
        """
        what = entry.what
        if isinstance(what, KeptSolution):
            return read_kept(self._session.store.kept, what)
        if isinstance(what, OfRun):
            found = solution_of_run(what.run, what.orbit)
            if found is None:
                raise InputError(f"run {what.run.name}: orbit {what.orbit} is gone")
            return found
        result = self._session.store.result(what.orbit, what.settings, what.is_what_if)
        if result is None:
            return Request(what.orbit, what.settings, what.is_what_if)
        return Solution(what.orbit, what.settings, result, is_what_if=what.is_what_if)

    def to_compare_with(self, entry: Entry) -> Solution:
        """Return a solution of the list; InputError if it is damaged or has to be fitted again."""
        found = self.load(entry)
        if isinstance(found, Request):
            raise InputError("this solution has to be fitted again: show it first")
        return found

    def rename(self, entry: Entry, name: str) -> None:
        """Give a solution of the session a name; a what-if on the screen stays in the list.

        Raises
        ------
        InputError
            If the name has characters that cannot be seen.
        """
        require_visible(name, "name of a solution")
        if isinstance(entry.what, MadeSolution):
            if entry.what == self._what_if():
                self._session.list_what_if()
            self._session.journal.rename(entry.what, name)

    def keep(self, entry: Entry, name: str) -> None:
        """Keep a solution of the session on disk; InputError if it cannot be kept."""
        if not isinstance(entry.what, MadeSolution):
            raise InputError("this solution is on disk already")
        self._session.store.keep(entry.what, name)
        self.rename(entry, name)

    def _what_if(self) -> MadeSolution | None:
        """Return the what-if on the screen, unless it is among the solutions of the session."""
        shown = self._session.shown
        if shown is None or not shown.is_replaceable:
            return None
        made = MadeSolution(shown.orbit, shown.settings, shown.is_what_if)
        return None if any(one.is_of(made) for one in self._session.journal.made) else made

    def _of_kept(self, kept: KeptSolution) -> Entry:
        try:
            settings = kept.settings().describe()
        except InputError:
            settings = _DAMAGED
        return Entry(kept, kept.orbit, kept.name, settings, f"{_how(kept.is_what_if)}, kept")

    def _of_run(self, run: Run, orbit: int | None) -> Entry | None:
        if orbit is None or not run.has_fitted(orbit):
            return None
        return Entry(OfRun(run, orbit), orbit, run.name, _described(run), "run")


def _described(run: Run) -> str:
    try:
        return run_settings(run).describe()
    except InputError:
        return _DAMAGED


def label_of(solution: Solution, entries: Mapping[str, Entry]) -> str | None:
    """Return the label of a solution in a list; None if it is not there."""
    for label, entry in entries.items():
        what = entry.what
        if isinstance(what, OfRun):
            is_same = (what.run.name, what.orbit) == (solution.run, solution.orbit)
        elif isinstance(what, KeptSolution):
            is_same = what.name == solution.kept
        else:
            made = MadeSolution(solution.orbit, solution.settings, solution.is_what_if)
            is_same = not (solution.run or solution.kept) and what.is_of(made)
        if is_same:
            return label
    return None


def _how(is_what_if: bool) -> str:
    return "what-if" if is_what_if else "fit"


def by_label(entries: list[Entry]) -> dict[str, Entry]:
    """Return entries by their labels, which are made different by a number."""
    found: dict[str, Entry] = {}
    for entry in entries:
        same = sum(one.label == entry.label for one in found.values())
        found[entry.label + (f" ({same + 1})" if same else "")] = entry
    return found
