"""HeldJob: the job that a session waits for."""

from plateviz.dashboard.session.journal import Journal
from plateviz.dashboard.session.solution import Request
from plateviz.solving.job import Job
from plateviz.solving.solution_store import SolutionStore


class HeldJob:
    """The job that a session waits for, which the page takes up after a reload.

    The server keeps the session of a page that was loaded again for a while, and it would hold the
    job: the new session gives up for both.

    Attributes
    ----------
    job : waiting or running; None if there is none
    """

    def __init__(self, store: SolutionStore, journal: Journal) -> None:
        """Begin without a job."""
        self._store, self._journal = store, journal
        self.job: Job | None = None
        self._is_held = False

    def begin(self, request: Request) -> Job:
        """Request a job in place of the one before, which is over or given up."""
        self.job, self._is_held = self._store.request(*request), True
        self._journal.expect(request, self.job, self.let_go)
        return self.job

    def end(self) -> None:
        """Wait for the job no longer: it is over."""
        if self.job is not None:
            self._journal.forget(self.job)
        self.job = None

    def give_up(self) -> bool:
        """Give up the job; return whether it stops, as no other page waits for it."""
        job = self.job
        if job is None:
            return True
        self._journal.let_others_go(job, self.let_go)
        if not self._is_held:
            job.hold()
        self._is_held = False
        self._journal.forget(job)
        return self._store.cancel(job)

    def let_go(self) -> None:
        """Leave the job to other pages, and follow it still."""
        if self.job is not None and self._is_held:
            self._store.abandon(self.job)
        self._is_held = False

    def leave(self) -> None:
        """Leave the job to other pages; it goes on."""
        self.let_go()
        self.job = None
