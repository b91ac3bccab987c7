"""Session: the solutions of one browser session and their rules, without Panel; views watch it.

The last solution stays on the screen until the next one is complete; then both can be compared.
"""

import param

from plateviz.dashboard.selection.large_selections import LargeSelections
from plateviz.dashboard.selection.selection import Selection
from plateviz.dashboard.session.fit_choices import ANSWERED_AT_ONCE, FitChoices
from plateviz.dashboard.session.held_job import HeldJob
from plateviz.dashboard.session.journal import Journal
from plateviz.dashboard.session.judging import Judging
from plateviz.dashboard.session.on_screen import SolutionsOnScreen
from plateviz.dashboard.session.shown_part import ShownPart
from plateviz.dashboard.session.solution import Request, Solution, what_if_settings
from plateviz.dashboard.session.stage import Stage
from plateviz.dashboard.session.units import Units
from plateviz.solving.job import Job, JobStatus
from plateviz.solving.solution_store import SolutionStore
from solver.data.settings import ENGINES, FitSettings
from solver.errors import InputError


class Session(SolutionsOnScreen):
    """State of one browser session.

    `journal` lists the solutions of the session, of all orbits.
    """

    theme = param.Selector(default="light", objects=["light", "dark"])

    def __init__(self, store: SolutionStore, large: LargeSelections | None = None) -> None:
        """Begin with the first orbit, the paper's settings and the `large` selections so far."""
        super().__init__()
        self.store = store
        self.shown_part, self.selection = ShownPart(), Selection(large)
        self.choices = FitChoices()
        self.units = Units(store.instrument)
        self.journal = Journal(store.made)
        self.judging = Judging(self, store.judge)
        self.shown_part.offer_orbits(store.orbits)
        self._detectors = store.instrument.detector_ids
        self._held = HeldJob(store, self.journal)
        self._requested = Request(store.orbits[0], FitSettings())
        self._next_what_if: FitSettings | None = None
        # What is put on the screen after the requested solution, one after the other.
        self._later: list[Solution | Request] = []
        self._is_opening = False
        self.choices.param.watch(
            lambda *_: self.ask_what_if(),
            [*ANSWERED_AT_ONCE, "what_if_at_once"],
        )
        self.journal.param.watch(lambda *_: self._take_up(), "awaited")

    @property
    def job(self) -> Job | None:
        """The waiting or running job; None if there is none."""
        return self._held.job

    @property
    def is_fitting(self) -> bool:
        """Whether there is a job that is no what-if."""
        return self.job is not None and not self._requested.is_what_if

    @property
    def is_opening(self) -> bool:
        """Whether a solution that was asked for by `open` is not on the screen yet."""
        return self.job is not None and self._is_opening

    def show_orbit(self, orbit: int | None, settings: FitSettings | None = None) -> None:
        """Request an orbit with some settings; by default with those of the last solution."""
        last = self.shown.settings if self.shown else self._requested.settings
        self._begin([Request(orbit, settings or last)])

    def show_result(self, solution: Solution) -> None:
        """Show a solution that is there, such as that of a run, without a request."""
        self._cancel_job()
        self.shown_part.orbit = solution.orbit
        if self.shown is not None and self.shown.equals(solution):
            self.param.update(stage=Stage.READY, message="")
            return
        self.open(solution)

    def open(self, solution: Solution | Request, other: Solution | Request | None = None) -> None:
        """Show a solution beside another one; what is not there yet is computed first."""
        before: list[Solution | Request] = []
        if other is not None and other.orbit == solution.orbit:
            before = [other] if other.settings != solution.settings else []
        self._begin([*before, solution], is_opening=True)
        if isinstance(other, Solution) and not before:
            self.compare_with(other)
        self.choices.load(solution.settings)

    def _begin(self, solutions: list[Solution | Request], is_opening: bool = False) -> None:
        self._cancel_job()
        self._is_opening = is_opening
        self._later, self.coming = solutions, solutions[-1]
        orbit = self.coming.orbit
        self.shown_part.orbit = orbit
        if self.shown is None or self.shown.orbit != orbit:
            self.solutions = []
            if self.shown is not None:
                self.store.leave(self.shown.orbit)
        self.chosen_other = self.other = None
        self._show_next()

    def _show_next(self) -> None:
        """Show what is to be shown next, up to what has to be computed."""
        while self._later and self.job is None:
            first = self._later.pop(0)
            if isinstance(first, Request):
                self._request(first)
            else:
                self._put_on_screen(first)
        self._is_opening &= self.job is not None
        self._take_up()

    def _take_up(self) -> None:
        """Follow what the page had asked for before it was loaded again, if it is of its orbit.

        Until something is asked for, nothing is on the screen that it could follow.
        """
        awaited = self.journal.awaited
        if awaited is None or (self.shown is None and self.job is None):
            return
        self.journal.awaited = None
        request, status = Request.of(awaited.made), awaited.job.status
        is_asked_for = self.job is not None and self._requested == request
        is_shown = self.shown is not None and self.shown.answers(request)
        if request.orbit != self.shown_part.orbit or is_asked_for or is_shown:
            return
        if status is JobStatus.FAILED:
            self.refuse(awaited.job.message)
        elif status is not JobStatus.CANCELLED:
            self._later.append(request)
            self._show_next()
            # What has been changed for it; without a what-if of its own.
            self.choices.load(request.settings)

    def refit(self) -> None:
        """Request a fit with the settings of the controls; report an invalid one at once."""
        try:
            settings = self.choices.settings()
        except InputError as error:
            self.refuse(str(error))
            return
        asked = Request(self.shown_part.orbit, settings)
        if self.job is None or self._requested != asked:
            self._cancel_job()
            self._request(asked)

    def awaits(self, settings: FitSettings) -> bool:
        """Return whether a solution of the orbit with these settings is being computed."""
        if self.job is None or self._requested.orbit != self.shown_part.orbit:
            return False
        # A what-if does not compare the orders.
        asked, wanted = (
            one.with_(compare_orders=False) for one in (self._requested.settings, settings)
        )
        return asked == wanted

    def ask_what_if(self) -> None:
        """Request a what-if with the settings of the controls; the fitted solution is kept.

        Only the gauss-newton engine is fast enough. While a what-if is being computed, only the
        latest settings wait.
        """
        fitted = self.fitted
        if not self.choices.what_if_at_once or fitted is None:
            return
        try:
            settings = what_if_settings(self.choices.settings(), fitted.settings)
        except InputError as error:
            self.refuse(str(error))
            return
        if settings.engine != ENGINES[0]:
            return
        known = next((s for s in self.solutions if s.settings == settings), None)
        if self.job is not None:
            self._next_what_if = settings if self._requested.is_what_if else None
        elif self.shown is not None and settings == self.shown.settings:
            return
        elif known is not None:
            self._return_to(known)
        else:
            self._request(Request(self.shown_part.orbit, settings, is_what_if=True))

    def list_what_if(self) -> None:
        """Add the what-if on the screen to the list, so that the next one does not replace it."""
        if self.shown is not None and self.shown.is_replaceable:
            listed = self.shown._replace(is_replaceable=False)
            self.param.update(solutions=[*self.solutions, listed], shown=listed)
            self.journal.add(listed)

    def cancel(self) -> None:
        """Cancel the waiting or running job."""
        self._next_what_if, self._later = None, []
        if not self._held.give_up():
            self._held.leave()
            self.refuse("Another page waits for this fit, which goes on; the last solution stays.")

    def close(self) -> None:
        """Leave the waiting or running job, if there is one, to other pages; it goes on.

        The page that is loaded again takes it up.
        """
        self._held.leave()

    def poll(self) -> None:
        """Update the state from the job; called periodically while there is one."""
        if self.job is None:
            return
        status = self.job.status
        if status is JobStatus.DONE:
            self._held.end()
            self._show_finished(self._requested)
            self._show_next()
            if self._next_what_if is not None and self.job is None:
                self._next_what_if = None
                self.ask_what_if()
        elif status.is_over:
            reason = self.job.message or "The fit was cancelled; the last solution stays."
            self._held.end()
            self._later = []
            self.refuse(reason)
        else:
            self.follow(self.job)

    def bring_up(self, solution: Solution) -> None:
        """Show an earlier solution; the fitted one on the screen becomes the other."""
        if solution is not self.shown:
            self.param.update(shown=solution, other=self._beside(solution, self.fitted))
            self.choices.load(solution.settings)

    def open_listed(self, solution: Solution | Request) -> None:
        """Show a solution of the list; that on the screen becomes the other, if of this orbit."""
        is_here = self.shown is not None and self.shown.orbit == solution.orbit
        if is_here and isinstance(solution, Solution):
            self._cancel_job()
            self._put_on_screen(solution)
            self.choices.load(solution.settings)
        else:
            self.open(solution, self.fitted if is_here else None)

    def exchange(self) -> None:
        """Exchange the solution on the screen with the one that it is compared with, if any."""
        shown, other = self.shown, self.other
        if shown is None or other is None:
            return
        if self.chosen_other is not None:
            self.chosen_other = shown
        if shown.orbit != other.orbit:
            self._cancel_job()
            self.param.update(solutions=[] if other.is_replaceable else [other])
            self.shown_part.orbit = other.orbit
        self.param.update(shown=other, other=shown)
        self.choices.load(other.settings)

    def _request(self, request: Request) -> None:
        self._requested = request
        self.advice = ""
        job = self._held.begin(request)
        if not job.status.is_over:
            self.follow(job, stage=Stage.STALE if self.shown else Stage.LOADING)
        self.poll()

    def _cancel_job(self) -> None:
        self._held.give_up()
        self._held.leave()
        self._next_what_if, self._later = None, []
        self._is_opening = False

    def _show_finished(self, request: Request) -> None:
        result = self.store.result(*request)
        if result is None:
            self.refuse("The result of the fit was removed.")
        else:
            self._put_on_screen(Solution.of(request, result))

    def _put_on_screen(self, solution: Solution) -> None:
        problems = self.shown_part.limit_to(solution.result, self._detectors)
        before = self.fitted if self.fitted and self.fitted.orbit == solution.orbit else None
        self._fitted = before or solution
        kept = [s for s in self.solutions if s.settings != solution.settings]
        self.param.update(
            solutions=self.solutions if solution.is_replaceable else [*kept, solution],
            other=self._beside(solution, before),
            shown=solution,
            stage=Stage.READY,
            message="",
        )
        self.journal.add(solution)
        self.note(problems)

    def limit_shown_part(self) -> None:
        """Limit what is shown to the solution on the screen, after an address changed it."""
        if self.shown is not None:
            self.note(self.shown_part.limit_to(self.shown.result, self._detectors))
