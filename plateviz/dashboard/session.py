"""Session: the solutions of one browser session and their rules, without Panel; views watch it.

The last solution stays on the screen until the next one is complete; then both can be compared.
"""

from dataclasses import replace
from enum import Enum

import param

from plateviz.dashboard.solution import Solution
from plateviz.dashboard.state import ANSWERED_AT_ONCE, FitChoices, Selection
from plateviz.solving.job import Job, JobStatus
from plateviz.solving.solution_store import SolutionStore
from solver.data.result import FitResult
from solver.data.settings import ENGINES, FitSettings
from solver.errors import InputError


class Stage(Enum):
    """State of the solution on the screen."""

    LOADING = "the first solution is being computed"
    READY = "the solution is the requested one"
    STALE = "another solution is being computed"
    FAILED = "the last request failed"


class Session(param.Parameterized):
    """State of one browser session.

    `shown` is the solution on the screen, `other` the one that it is compared with; either may
    be None. `stage` and `message` are the state of the last request.
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
        self._requested: FitSettings = FitSettings()
        self._requested_what_if = False
        self._next_what_if: FitSettings | None = None
        self._unprepared: Solution | None = None
        self.choices.param.watch(
            lambda *_: self.ask_what_if(),
            [*ANSWERED_AT_ONCE, "what_if_at_once"],
        )

    @property
    def job(self) -> Job | None:
        """The waiting or running job; None if there is none."""
        return self._job

    def show_orbit(self, orbit: int | None) -> None:
        """Request an orbit with the settings of the solution on the screen."""
        self.selection.orbit = orbit
        settings = self.shown.settings if self.shown else self._requested
        self.param.update(solutions=[], other=None)
        self._request(settings)

    def show_result(self, orbit: int | None, result: FitResult) -> None:
        """Show an orbit with an existing result, without a request."""
        self._cancel_job()
        self.selection.orbit = orbit
        solution = Solution(orbit, result.settings, result)
        if self.shown is not None and self.shown._replace(result=result) == solution:
            self.param.update(stage=Stage.READY, message="")
            return
        self.param.update(solutions=[], other=None)
        self._put_on_screen(solution)
        self.choices.load(result.settings)
        self._unprepared = solution

    def prepare_what_ifs(self) -> None:
        """Let the solver fit what the what-ifs of an existing result start from, once.

        The page asks for it when it has nothing left to draw.
        """
        solution, self._unprepared = self._unprepared, None
        if solution is not None and self.shown is solution and self.choices.what_if_at_once:
            self.store.prepare(solution.orbit, solution.settings)

    def refuse(self, message: str) -> None:
        """Show why a request failed; the last solution stays."""
        self.param.update(stage=Stage.FAILED, message=message)

    def refit(self) -> None:
        """Request a fit with the settings of the controls; report an invalid one at once."""
        try:
            settings = self.choices.settings()
        except InputError as error:
            self.refuse(str(error))
            return
        self._request(settings)

    def ask_what_if(self) -> None:
        """Request a what-if with the settings of the controls; the fitted solution is kept.

        Only the gauss-newton engine is fast enough. While a what-if is being computed, only the
        latest settings wait.
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
            self._next_what_if = settings if self._requested_what_if else None
        elif known is not None:
            self._return_to(known)
        elif self.shown is None or settings != self.shown.settings:
            self._request(settings, what_if=True)

    @property
    def fitted(self) -> Solution | None:
        """The solution on the screen, or the one that a what-if is compared with."""
        return self.other if self.shown is not None and self.shown.is_what_if else self.shown

    def keep(self) -> None:
        """Keep the what-if on the screen."""
        if self.shown is not None and self.shown.is_what_if:
            kept = self.shown._replace(is_what_if=False)
            self.param.update(solutions=[*self.solutions, kept], shown=kept)

    def select_sources(self, sources: frozenset[int]) -> None:
        """Select sources by their ids, in place of those selected before."""
        self.selection.sources = sources

    def subject(self) -> str:
        """Return the orbit on the screen as it is named in files, such as "orbit-3"."""
        return f"orbit-{self.selection.orbit}"

    @property
    def selected_ids(self) -> frozenset[str]:
        """The selected sources as tables of figures name them."""
        return frozenset(map(str, self.selection.sources))

    @property
    def selected_in_orbit(self) -> frozenset[int]:
        """The selected sources among those that the orbit on the screen has measured."""
        return self.selection.sources & self._measured

    @property
    def is_selection_left_out(self) -> bool:
        """Whether the next fit uses none of the selected sources, though some are measured."""
        selected = self.selected_in_orbit
        return bool(selected) and selected <= self._left_out

    def invert_selection(self) -> None:
        """Select the other sources of the orbit on the screen."""
        self.selection.sources = self._measured - self.selection.sources

    def leave_out_selection(self) -> None:
        """Exclude the selected sources from the next fit, which shows a what-if."""
        if not self.selected_in_orbit:
            self.refuse("The orbit on the screen has measured none of the selected sources.")
            return
        self._exclude(self._left_out | self.selected_in_orbit)

    def put_back_selection(self) -> None:
        """Include the selected sources in the next fit, which shows a what-if."""
        self._exclude(self._left_out - self.selection.sources)

    @property
    def _measured(self) -> frozenset[int]:
        """Sources of the orbit on the screen, those among them that are left out."""
        if self.shown is None:
            return frozenset()
        excluded = self.shown.settings.exclusions.sources
        return excluded.union(self.shown.result.sources["source_id"].tolist())

    @property
    def _left_out(self) -> frozenset[int]:
        try:
            return self.choices.settings().exclusions.sources
        except InputError:
            return frozenset()

    def _exclude(self, sources: frozenset[int]) -> None:
        try:
            settings = self.choices.settings()
        except InputError as error:
            # Other settings than exclusions may be invalid; nothing is changed for them.
            self.refuse(str(error))
            return
        self.choices.load(settings.with_(exclusions=replace(settings.exclusions, sources=sources)))

    def cancel(self) -> None:
        """Cancel the waiting or running job."""
        self._next_what_if = None
        if self._job is not None and not self.store.cancel(self._job):
            self._job = None
            self.refuse("Another page waits for this fit, which goes on; the last solution stays.")

    def close(self) -> None:
        """Leave the waiting or running job, if there is one, to other pages; it goes on."""
        if self._job is not None:
            self.store.abandon(self._job)
        self._job = None

    def poll(self) -> None:
        """Update the state from the job; called periodically while there is one."""
        if self._job is None:
            return
        status = self._job.status
        if status is JobStatus.DONE:
            self._job = None
            self._show_finished(self._requested)
            if self._next_what_if is not None:
                self._next_what_if = None
                self.ask_what_if()
        elif status.is_over:
            reason = self._job.message or "The fit was cancelled; the last solution stays."
            self._job = None
            self.refuse(reason)
        else:
            self.message = self._job.progress_text

    def bring_up(self, solution: Solution) -> None:
        """Show an earlier solution; the fitted one on the screen becomes the other."""
        if solution is not self.shown:
            self.param.update(shown=solution, other=self.fitted)
            self.choices.load(solution.settings)

    def exchange(self) -> None:
        """Exchange the solution on the screen with the one that it is compared with, if any."""
        shown, other = self.shown, self.other
        if shown is not None and other is not None:
            self.param.update(shown=other, other=shown)
            self.choices.load(other.settings)

    def _return_to(self, solution: Solution) -> None:
        """Return from a what-if to a kept solution, alone if the what-if was compared with it."""
        if solution is not self.shown:
            other = self.fitted if self.fitted is not solution else None
            self.param.update(shown=solution, other=other, stage=Stage.READY, message="")

    def _request(self, settings: FitSettings, what_if: bool = False) -> None:
        self._cancel_job()
        self._requested, self._requested_what_if = settings, what_if
        self._job = self.store.request(self.selection.orbit, settings, what_if)
        stage = Stage.STALE if self.shown else Stage.LOADING
        self.param.update(stage=stage, message=self._job.progress_text)
        self.poll()

    def _cancel_job(self) -> None:
        if self._job is not None:
            self.store.cancel(self._job)
        self._job, self._next_what_if = None, None

    def _show_finished(self, settings: FitSettings) -> None:
        orbit = self.selection.orbit
        result = self.store.result(orbit, settings, self._requested_what_if)
        if result is None:
            self.refuse("The result of the fit was removed.")
            return
        self._put_on_screen(Solution(orbit, settings, result, self._requested_what_if))

    def _put_on_screen(self, solution: Solution) -> None:
        numbers = [d.detector_id for d in self.store.instrument.detectors]
        self.selection.limit_to(solution.result, numbers)
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
    """Return the settings of a what-if; it keeps a comparison of orders only if still valid."""
    is_still_valid = settings.with_(order=fitted.order, compare_orders=True) == fitted
    return settings.with_(compare_orders=is_still_valid)
