"""A store without a solver for the tests of a session, whose jobs are ended by the test."""

from concurrent.futures import Executor, Future
from pathlib import Path

from plateviz.runs.kept_solutions import KeptSolutions
from plateviz.solving.job import Job
from plateviz.solving.made_solutions import MadeSolutions
from plateviz.solving.run_reader import RunReader
from plateviz.solving.turns import Turns
from solver.data.instrument import MINI_MOCK
from solver.errors import InputError


class AtOnce(Executor):
    """Runs what it is given before it returns."""

    def submit(self, work, /, *arguments):
        answer = Future()
        try:
            answer.set_result(work(*arguments))
        except InputError as error:
            answer.set_exception(error)
        return answer

    def listen(self, listener):
        """Nothing is left to be done."""


class NoSelections:
    """Keeps no selection."""

    def all(self):
        return {}

    def keep(self, name, selected, before):
        pass

    def forget(self, name, before):
        pass


class JudgedAll:
    """Has judged every solution."""

    def has_judged(self, result):
        return True

    def request(self, result):
        pass


class FakeStore:
    """A store without a solver, which records its requests."""

    orbits = (0, 1)
    instrument = MINI_MOCK
    simulation = None
    title = "store"

    def __init__(self, result):
        self._result = result
        self.requested, self.prepared, self.cancelled, self.abandoned = [], [], [], []
        self.left, self.pauses, self._has_result = [], 0, False
        self.judge = JudgedAll()
        self.background = AtOnce()
        self.run_reader = RunReader(self.background)
        self.is_shared, self.reports = False, Turns()
        self.made, self.kept = MadeSolutions(), KeptSolutions(Path("nowhere"))
        self.selections = NoSelections()

    def request(self, orbit, settings, what_if=False):
        self.requested.append((orbit, settings, Job({"do": "fit", "what_if": what_if})))
        return self.requested[-1][2]

    def prepare(self, orbit, settings, likely=(), *, may_fit=True, is_urgent=False):
        self.prepared.append((orbit, settings, list(likely), may_fit, is_urgent))

    def pause(self):
        self.pauses += 1

    def leave(self, orbit):
        self.left.append(orbit)

    def cancel(self, job):
        self.cancelled.append(job)
        if not self.is_shared:
            job.cancel()
        return not self.is_shared

    def abandon(self, job):
        self.abandoned.append(job)

    def result(self, orbit, settings, what_if=False):
        return self._result

    def has_result(self, orbit, settings, what_if=False):
        return self._has_result


def finish(session):
    """Let the solver have made what a session waits for."""
    session.job.take({"event": "done"})
    session.poll()
