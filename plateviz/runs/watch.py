"""Watch a survey that grows: fit its orbits as they arrive, and say what is not well.

The run stays open: its tables over all orbits are written again after each look that found an
orbit, and it becomes complete when the number of orbits that are waited for is done, or when
`plateviz survey` fits it as a whole.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from time import sleep
from typing import Any, NamedTuple

from plateviz.runs.arrivals import Arrivals, Remark
from plateviz.runs.dask_workers import Outcome
from plateviz.runs.fit_survey import Progress, close_run, fit_missing
from plateviz.runs.fitted_orbit import read_summary
from plateviz.runs.new_run import begin_run, fitting_alone
from plateviz.runs.run_directory import RunDirectory
from plateviz.tables.counts import orbits_are, orbits_text
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.io.survey import survey_orbits
from solver.io.table_check import refuse

# Seconds between the two looks of a watch that ends with what is there.
_SETTLING_SECONDS = 2.0


class Event(NamedTuple):
    """One thing that happened.

    Attributes
    ----------
    kind : "watching", "fitting", "fitted", "failed", "waiting", "damaged", "changed", "complete" or
        "ended"
    orbit : its id; None if it is not about one orbit
    message : in words
    figures : numbers and texts that belong to it, by name
    """

    kind: str
    orbit: int | None
    message: str
    figures: Mapping[str, Any]


class Ends(NamedTuple):
    """When a watch ends by itself.

    Attributes
    ----------
    at_once : after what is there now has been fitted
    until : when so many orbits are done: fitted, or without a solution; None for never
    """

    at_once: bool = False
    until: int | None = None


@dataclass
class Watch:
    """The fit of a survey that grows.

    Attributes
    ----------
    survey : its directory
    name : of the run
    settings : of every fit
    workers : number of processes; one per core by default
    tell : called with every event
    fitted : orbits fitted so far
    failed : reasons why orbits have no solution, by orbit
    distrusted : orbits fitted so far whose solutions should not be trusted
    has_begun : whether the run is locked and found whole
    unread : why orbits, or all of them, could not be read at the last look
    """

    survey: Path
    name: str
    settings: FitSettings
    workers: int | None
    tell: Callable[[Event], None]
    fitted: list[int] = field(default_factory=list)
    failed: dict[int, str] = field(default_factory=dict)
    distrusted: list[int] = field(default_factory=list)
    has_begun: bool = False
    unread: list[str] = field(default_factory=list)

    def run(self, interval: float, ends: Ends) -> None:
        """Fit orbits as they arrive, until the watch ends or is interrupted.

        Parameters
        ----------
        interval : seconds between two looks

        Raises
        ------
        DiskError
            If the disk is full or read-only; what is fitted is kept.
        InputError
            If the survey is none or is gone, its catalogue or the run's settings are others, the
            run is complete and the survey has more orbits, or another process is fitting the run.
        """
        run = begin_run(self.survey, self.name, self.settings, grows=True)
        with fitting_alone(run):
            if run.is_complete:
                _require_nothing_new(run)
                self._say("complete", f"{run.directory} is complete; nothing is left to fit")
                return
            refuse(run.changes())
            self.has_begun = True
            self._follow(run, interval, ends)

    def end(self) -> None:
        """Say that the watch has ended, and what it did, if it began."""
        if not self.has_begun:
            return
        words = f"ended; {orbits_text(len(self.fitted))} fitted"
        words += f", {len(self.failed)} without a solution" if self.failed else ""
        figures = {"fitted": self.fitted, "failed": sorted(self.failed)}
        self._say("ended", words, **figures, distrusted=self.distrusted)

    def _follow(self, run: RunDirectory, interval: float, ends: Ends) -> None:
        """Look and fit until the watch ends."""
        arrivals, standing = Arrivals(run), frozenset[Remark]()
        there = run.complete_orbits()
        self._say("watching", _beginning(run, there), run=run.name, fitted=len(there))
        is_second = False
        while True:
            look = arrivals.look()
            standing = self._remark(look.remarks, standing)
            self.unread = [one.message for one in look.remarks if one.is_fault]
            self._fit(run, arrivals, look.ready)
            if ends.until is not None and self._done(run) >= ends.until:
                self._close(run)
                return
            if ends.at_once and (look.is_settled or is_second):
                return
            is_second = True
            sleep(min(interval, _SETTLING_SECONDS) if ends.at_once else interval)

    def _remark(self, remarks: Iterable[Remark], standing: frozenset[Remark]) -> frozenset[Remark]:
        """Say what was not said at the look before."""
        for remark in remarks:
            if remark not in standing:
                self.tell(Event(remark.kind, remark.orbit, remark.message, {}))
        return frozenset(remarks)

    def _fit(self, run: RunDirectory, arrivals: Arrivals, orbits: list[int]) -> None:
        """Fit orbits that are whole, and gather those that were fitted and not gathered before."""
        if not orbits and run.gathered_orbits() == run.complete_orbits():
            return
        # The catalogue may have been replaced.
        begin_run(self.survey, self.name, self.settings, grows=True)
        arrivals.try_orbits(orbits)
        if orbits:
            self._say("fitting", f"{orbits_are(len(orbits))} being fitted", orbits=orbits)

        def tell(progress: Progress) -> None:
            if progress.last is not None:
                self._tell_outcome(run, progress.last, arrivals.is_as_tried(progress.last.orbit))

        fit_missing(run, orbits, self.workers, None, tell, closes=False)

    def _tell_outcome(self, run: RunDirectory, outcome: Outcome, is_as_tried: bool) -> None:
        """Say what became of an orbit, unless it is tried again since its files were written."""
        orbit, seconds = outcome.orbit, outcome.seconds
        if not outcome.message:
            verdict = read_summary(run.orbit_directory(orbit))["verdict"]
            self.fitted.append(orbit)
            self.failed.pop(orbit, None)
            if verdict["state"] == "bad":
                self.distrusted.append(orbit)
            words = " ".join([verdict["headline"], *verdict["faults"]])
            self.tell(
                Event("fitted", orbit, words, {"seconds": seconds, "state": verdict["state"]})
            )
        elif is_as_tried:
            self.failed[orbit] = outcome.message
            self.tell(Event("failed", orbit, outcome.message, {"seconds": seconds}))

    def _done(self, run: RunDirectory) -> int:
        return len(run.complete_orbits()) + len(self.failed)

    def _close(self, run: RunDirectory) -> None:
        """Mark the run as complete if no orbit of the survey is missing."""
        close_run(run)
        if run.is_complete:
            self._say("complete", f"{run.directory} is complete, and is not changed any more")

    def _say(self, kind: str, message: str, **figures: object) -> None:
        self.tell(Event(kind, None, message, figures))


def _require_nothing_new(run: RunDirectory) -> None:
    """Refuse a complete run of a survey that has more orbits."""
    others = sorted(set(survey_orbits(run.survey)) - set(run.complete_orbits()))
    if others:
        raise InputError(
            f"{run.directory}: expected a run to which orbits can be added, found a complete one, "
            f"which is not changed; orbit {others[0]} is not in it. Give another --run NAME"
        )


def _beginning(run: RunDirectory, there: list[int]) -> str:
    return f"watching {run.survey} for the run {run.name}; {orbits_are(len(there))} fitted already"
