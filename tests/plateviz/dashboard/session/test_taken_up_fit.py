"""A fit that a page waited for is taken up when the page is loaded again."""

import pytest

from plateviz.dashboard.session.journal import Journal
from plateviz.dashboard.session.session import Session
from plateviz.dashboard.session.stage import Stage
from plateviz.solving.job import JobStatus
from solver.data.settings import FitSettings
from tests.plateviz.dashboard.fake_store import FakeStore, finish

KEY = "0123456789abcdef" * 2
SETTINGS = FitSettings(order=4, engine="svi")


class SharedStore(FakeStore):
    """A store whose jobs are shared by those who request the same, and stop without a holder."""

    def __init__(self, result):
        super().__init__(result)
        self.jobs = {}

    def request(self, orbit, settings, what_if=False):
        known = self.jobs.get((orbit, settings.order, what_if))
        if known is None or known.status in (JobStatus.FAILED, JobStatus.CANCELLED):
            known = super().request(orbit, settings, what_if)
            self.jobs[orbit, settings.order, what_if] = known
        known.hold()
        return known

    def cancel(self, job):
        is_last = job.release()
        if is_last:
            job.cancel()
        return is_last

    def abandon(self, job):
        job.release()


@pytest.fixture
def store(fit_result):
    return SharedStore(fit_result)


def opened(store, orbit=0, key=KEY):
    """A page with an orbit on the screen, as its address names it, whose browser has a key."""
    session = Session(store)
    session.show_orbit(orbit)
    if session.job is not None:
        finish(session)
    session.journal.resume(key)
    return session


@pytest.fixture
def first(store):
    """A page that waits for a fit."""
    session = opened(store)
    session.choices.load(SETTINGS)
    session.refit()
    return session


def listed(session):
    return [one.settings for one in session.journal.made]


@pytest.mark.parametrize("is_gone", [True, False])
def test_running_fit_is_followed_and_shown(store, first, is_gone):
    job = first.job
    if is_gone:
        first.close()
    again = opened(store)
    assert again.job is job
    assert (again.stage, again.shown.settings) == (Stage.STALE, FitSettings())
    assert again.choices.settings() == SETTINGS
    job.take({"event": "progress", "stage": "step 3"})
    again.poll()
    assert "step 3" in again.message
    finish(again)
    assert (again.stage, again.shown.settings) == (Stage.READY, SETTINGS)
    assert again.other.settings == FitSettings()
    assert listed(again) == [FitSettings(), SETTINGS]
    assert len(store.requested) == 2


@pytest.mark.parametrize("is_gone", [True, False])
def test_cancel_after_a_reload_stops_the_fit(store, first, is_gone):
    # The server keeps the session of the page that was left for a while.
    job = first.job
    again = opened(store)
    if is_gone:
        first.close()
    again.cancel()
    assert job.status is JobStatus.CANCELLED
    for session in (again, first):
        session.poll()
        assert session.job is None
    assert "cancelled" in again.message
    third = opened(store)
    assert (third.stage, third.job) == (Stage.READY, None)


def test_fit_that_another_person_waits_for_goes_on(store, first):
    other = opened(store, key=KEY[::-1])
    other.choices.load(SETTINGS)
    other.refit()
    job = other.job
    again = opened(store)
    again.cancel()
    assert "Another page waits" in again.message
    # The page that was left has given up its part already.
    first.close()
    assert job.status is JobStatus.QUEUED
    other.cancel()
    assert job.status is JobStatus.CANCELLED


def test_next_fit_after_a_reload_stops_the_one_before(store, first):
    job, again = first.job, opened(store)
    again.choices.order = 3
    again.refit()
    assert job.status is JobStatus.CANCELLED


def test_fit_that_is_complete_by_then_is_shown_and_listed(store, first):
    job = first.job
    first.close()
    job.take({"event": "done"})
    again = opened(store)
    assert (again.stage, again.shown.settings) == (Stage.READY, SETTINGS)
    assert sorted(one.order for one in listed(again)) == [4, 5]


def test_fit_that_failed_by_then_says_why(store, first):
    first.close()
    first_job = store.jobs[0, SETTINGS.order, False]
    first_job.fail("too few stars")
    again = opened(store)
    assert (again.stage, again.message) == (Stage.FAILED, "too few stars")


def test_fit_waits_for_the_solution_that_the_address_names(store, first):
    first.close()
    store.jobs.clear()
    store.jobs[0, SETTINGS.order, False] = job = store.requested[-1][2]
    again = Session(store)
    again.show_orbit(0)
    again.journal.resume(KEY)
    assert again.job is not job
    finish(again)
    assert (again.shown.settings, again.job) == (FitSettings(), job)


def test_first_fit_that_the_address_asks_for_is_asked_for_once(store):
    for _ in range(2):
        session = Session(store)
        session.show_orbit(0)
        session.journal.resume(KEY)
        assert session.job is not None
        assert session._later == []


def test_fit_is_taken_up_once_its_orbit_is_opened(store, first):
    job = first.job
    first.close()
    again = Session(store)
    again.journal.resume(KEY)
    assert again.job is None
    again.show_orbit(0)
    assert again.shown.settings == FitSettings()
    assert again.job is job


def test_fit_of_another_orbit_is_listed_when_it_is_complete(store, first):
    job = first.job
    first.close()
    again = opened(store, orbit=1)
    assert (again.job, again.stage) == (None, Stage.READY)
    job.take({"event": "done"})
    again.journal.look()
    assert SETTINGS in listed(again)
    assert again.shown.orbit == 1


def test_what_if_is_taken_up_and_not_listed(store):
    first = opened(store)
    first.choices.order = 3
    job = first.job
    first.close()
    job.take({"event": "done"})
    again = opened(store)
    assert again.shown.is_replaceable
    assert again.shown.settings.order == 3
    assert all(one.order != 3 for one in listed(again))


def test_pages_that_are_gone_are_not_kept_alive(store, first):
    first.close()
    del first
    (awaited,) = store.made.awaited(KEY)
    assert awaited.made.settings == SETTINGS
    assert Journal(store.made).awaited is None
