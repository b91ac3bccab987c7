"""Session: one person's solutions on one screen. No Panel here: views watch, this decides.

The old solution stays until the new one is whole; then both can be compared.
"""

from enum import Enum
from typing import NamedTuple

import param

from plateviz.dashboard.state import ANSWERED_AT_ONCE, FitChoices, Selection
from plateviz.solving.job import Job, JobStatus
from plateviz.solving.solution_store import SolutionStore
from solver.data.result import FitResult
from solver.data.settings import ENGINES, FitSettings
from solver.errors import InputError


class Stage(Enum):
    """What the screen can show."""

    LOADING = "the first solution is being made"
    READY = "the solution is what was asked for"
    STALE = "another solution is being made"
    FAILED = "the last request could not be met"


class Solution(NamedTuple):
    """One solution of the session and what it was asked for.

    One on trial was asked for by a change of the choices alone, and is gone with the next.
    """

    orbit: int | None
    settings: FitSettings
    result: FitResult
    is_what_if: bool = False

    @property
    def label(self) -> str:
        """The solution in a few words."""
        return (
            f"what if: {self.settings.describe()}" if self.is_what_if else self.settings.describe()
        )


class Session(param.Parameterized):
    """State of one browser session.

    `shown` is the solution on the screen, `other` the one it is compared with; either
    may be None. `stage` and `message` say how things stand.
    """

    shown = param.ClassSelector(class_=Solution, default=None, allow_None=True)
    other = param.ClassSelector(class_=Solution, default=None, allow_None=True)
    solutions = param.List(default=[], item_type=Solution)
    stage = param.ClassSelector(class_=Stage, default=Stage.LOADING)
    message = param.String(default="")
    theme = param.Selector(default="light", objects=["light", "dark"])

    def __init__(self, store: SolutionStore) -> None:
        """Begin with the first orbit and the paper's settings."""
        super().__init__()
        self.store = store
        self.selection = Selection()
        self.choices = FitChoices()
        self.selection.param["orbit"].objects = store.orbits
        self.selection.orbit = store.orbits[0]
        self._job: Job | None = None
        self._asked: FitSettings = FitSettings()
        self._asked_what_if = False
        self._next_what_if: FitSettings | None = None
        self.choices.param.watch(
            lambda *_: self.ask_what_if(),
            [*ANSWERED_AT_ONCE, "what_if_at_once"],
        )

    @property
    def job(self) -> Job | None:
        """The job that is under way, if any."""
        return self._job

    def show_orbit(self, orbit: int | None) -> None:
        """Turn to an orbit, with the settings of the solution on the screen."""
        self.selection.orbit = orbit
        settings = self.shown.settings if self.shown else self._asked
        self.param.update(solutions=[], other=None)
        self._ask(settings)

    def show_result(self, orbit: int | None, result: FitResult) -> None:
        """Turn to an orbit whose solution is at hand."""
        self._drop_job()
        self.selection.orbit = orbit
        solution = Solution(orbit, result.settings, result)
        if self.shown is not None and self.shown._replace(result=result) == solution:
            self.param.update(stage=Stage.READY, message="")
            return
        self.param.update(solutions=[], other=None)
        self._take(solution)
        self.choices.take(result.settings)

    def refuse(self, message: str) -> None:
        """Say why what was asked for cannot be had; the last solution stays."""
        self.param.update(stage=Stage.FAILED, message=message)

    def refit(self) -> None:
        """Ask for the orbit with the choices made; what cannot be used is said at once."""
        try:
            settings = self.choices.settings()
        except InputError as error:
            self.refuse(str(error))
            return
        self._ask(settings)

    def ask_what_if(self) -> None:
        """Show what the choices would change, while the solution that was fitted is kept.

        Only the gauss-newton engine is quick enough. While one trial is under way, the last
        of the choices made since waits for it.
        """
        fitted = self.fitted
        if not self.choices.what_if_at_once or fitted is None:
            return
        try:
            settings = _what_if_settings(self.choices.settings(), fitted.settings)
        except InputError as error:
            self.refuse(str(error))
            return
        if settings.engine != ENGINES[0]:
            return
        known = next((s for s in self.solutions if s.settings == settings), None)
        if self._job is not None:
            self._next_what_if = settings if self._asked_what_if else None
        elif known is not None:
            self._bring_back(known)
        elif self.shown is None or settings != self.shown.settings:
            self._ask(settings, what_if=True)

    @property
    def fitted(self) -> Solution | None:
        """The solution on the screen, or the one that a trial is compared with."""
        return self.other if self.shown is not None and self.shown.is_what_if else self.shown

    def keep(self) -> None:
        """Keep the solution that is on trial."""
        if self.shown is not None and self.shown.is_what_if:
            kept = self.shown._replace(is_what_if=False)
            self.param.update(solutions=[*self.solutions, kept], shown=kept)

    def cancel(self) -> None:
        """Stop the job that is under way."""
        self._next_what_if = None
        if self._job is not None:
            self.store.cancel(self._job)

    def poll(self) -> None:
        """Take in what has become of the job; called every so often while there is one."""
        if self._job is None:
            return
        status = self._job.status
        if status is JobStatus.DONE:
            self._job = None
            self._show(self._asked)
            if self._next_what_if is not None:
                self._next_what_if = None
                self.ask_what_if()
        elif status.is_over:
            reason = self._job.message or "The fit was cancelled; the last solution stays."
            self._job = None
            self.refuse(reason)
        else:
            self.message = _words(self._job)

    def bring_up(self, solution: Solution) -> None:
        """Show a solution that was made before; the one on the screen becomes the other."""
        if solution is not self.shown:
            self.param.update(shown=solution, other=self.fitted)
            self.choices.take(solution.settings)

    def _bring_back(self, solution: Solution) -> None:
        """Leave the trial for a solution that was kept; where it was compared with that, alone."""
        if solution is not self.shown:
            other = self.fitted if self.fitted is not solution else None
            self.param.update(shown=solution, other=other, stage=Stage.READY, message="")

    def _ask(self, settings: FitSettings, what_if: bool = False) -> None:
        self._drop_job()
        self._asked, self._asked_what_if = settings, what_if
        self._job = self.store.request(self.selection.orbit, settings, what_if)
        stage = Stage.STALE if self.shown else Stage.LOADING
        self.param.update(stage=stage, message=_words(self._job))
        self.poll()

    def _drop_job(self) -> None:
        if self._job is not None:
            self.store.cancel(self._job)
        self._job, self._next_what_if = None, None

    def _show(self, settings: FitSettings) -> None:
        orbit = self.selection.orbit
        result = self.store.result(orbit, settings, self._asked_what_if)
        if result is None:
            self.refuse("The result of the fit is gone.")
            return
        self._take(Solution(orbit, settings, result, self._asked_what_if))

    def _take(self, solution: Solution) -> None:
        numbers = [d.detector_id for d in self.store.instrument.detectors]
        self.selection.fit_to(solution.result, numbers)
        orbit, settings = solution.orbit, solution.settings
        before = self.fitted if self.fitted and self.fitted.orbit == orbit else None
        kept = [s for s in self.solutions if s.settings != settings]
        self.param.update(
            solutions=self.solutions if solution.is_what_if else [*kept, solution],
            other=before if before and before.settings != settings else None,
            shown=solution,
            stage=Stage.READY,
            message="",
        )


def _what_if_settings(settings: FitSettings, fitted: FitSettings) -> FitSettings:
    """Return what to try out: no orders are compared anew, but those of the fit may still hold."""
    still_holds = settings.with_(order=fitted.order, compare_orders=True) == fitted
    return settings.with_(compare_orders=still_holds)


def _words(job: Job) -> str:
    """Say how far a job is."""
    if job.status is JobStatus.QUEUED:
        return "waiting for the solver"
    last = job.progress[-1] if job.progress else {}
    words = str(last.get("stage", "starting"))
    if last.get("largest_step") == last.get("largest_step") and "largest_step" in last:
        words += f", largest step {last['largest_step']:.2g} sigma"
    return f"{words} ({job.seconds:.0f} s)"
