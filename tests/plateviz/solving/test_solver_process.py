"""Speculative work of the solver process, which gives way to requests."""

import queue
import threading

import pytest

from plateviz.solving import fitters, solver_process
from plateviz.solving.fitters import Fitters, prepare
from plateviz.solving.origin import SurveyFolder, origin_to_dict
from plateviz.solving.put_off import PutOff
from plateviz.solving.solver_process import _next_request
from solver.data.exclusions import Exclusions
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.errors import InputError
from solver.fit import OrbitFitter


@pytest.fixture
def requests():
    return queue.Queue()


def test_waiting_request_is_served_before_speculative_work(requests):
    done = []
    requests.put({"job": "1"})
    put_off = PutOff()
    put_off.add_eigenmodes(lambda: done.append("eigenmodes"))
    speculative = (done.append(step) for step in range(3))
    assert _next_request(requests, speculative, put_off) == {"job": "1"}
    assert done == []


def test_request_waits_for_one_step_at_most(requests):
    done = []

    def speculative():
        for step in range(3):
            done.append(step)
            if step == 1:
                requests.put({"job": "2"})
            yield

    put_off = PutOff()
    put_off.add_eigenmodes(lambda: done.append("eigenmodes"))
    assert _next_request(requests, speculative(), put_off) == {"job": "2"}
    assert done == ["eigenmodes", 0, 1]


def test_speculative_work_is_finished_without_requests(requests):
    done = []

    def speculative():
        for step in range(3):
            done.append(step)
            yield
        requests.put(None)

    assert _next_request(requests, speculative(), PutOff()) is None
    assert done == [0, 1, 2]


def test_verdict_is_next_and_eigenmodes_are_when_idle(requests, monkeypatch):
    done, put_off = [], PutOff()
    put_off.add_eigenmodes(lambda: done.append("eigenmodes"))
    put_off.add_verdict(lambda: done.append("verdict"))
    # The server sends the next request once it has heard that the one before is done.
    monkeypatch.setattr(solver_process, "_NEXT_S", 20.0)
    threading.Timer(0.02, requests.put, [{"job": "1"}]).start()
    _next_request(requests, iter(()), put_off)
    assert done == []
    monkeypatch.setattr(solver_process, "_NEXT_S", 0.0)
    put_off.add_verdict(lambda: requests.put({"job": "2"}))
    _next_request(requests, iter(()), put_off)
    assert done == ["verdict"]


def test_few_results_wait():
    """The verdicts of the others are done, and their eigenmodes given up until somebody asks."""
    done, put_off = [], PutOff()
    for number in range(4):
        put_off.add_verdict(lambda number=number: done.append(f"verdict {number}"))
        put_off.add_eigenmodes(lambda number=number: done.append(f"eigenmodes {number}"))
    put_off.limit()
    assert done == ["verdict 0", "verdict 1"]
    put_off.finish()
    put_off.finish()
    assert done[2:] == ["verdict 2", "verdict 3", "eigenmodes 2", "eigenmodes 3"]


def test_what_cannot_be_written_ends_nothing(requests):
    def full():
        raise InputError("the disk is full")

    put_off = PutOff()
    put_off.add_verdict(full)
    put_off.add_eigenmodes(lambda: requests.put({"job": "1"}))
    assert _next_request(requests, iter(()), put_off) == {"job": "1"}


class Fitter:
    """An orbit's fitter without an orbit: a fit takes its settings and tells of one iteration."""

    def __init__(self, fitted):
        self.fitted_settings = fitted

    def prepare_what_ifs(self, settings, progress, solution):
        progress(None)
        self.started_from = solution
        self.fitted_settings = settings

    def precompute(self, order):
        yield from range(order)


SETTINGS = FitSettings(order=3)
PREPARED = {"do": "prepare", "origin": "here", "orbit": 0, "settings": SETTINGS.to_dict()}


@pytest.fixture
def prepared_with(monkeypatch, requests):
    """Prepare an orbit that was fitted with some settings, or not; return the settings then."""

    def prepared(fitted=None):
        fitter, kept = Fitter(fitted), Fitters()
        monkeypatch.setattr(kept, "of", lambda request: fitter)
        steps = list(prepare(kept, PREPARED, requests))
        return fitter.fitted_settings, steps

    return prepared


def test_orbit_is_fitted_and_its_likely_what_ifs_are_precomputed(prepared_with):
    assert prepared_with() == (SETTINGS, [0, 1, 2])


def test_all_measurements_are_fitted_and_no_orders_compared(prepared_with, monkeypatch):
    special = SETTINGS.with_(exclusions=Exclusions(detectors=frozenset([1])), compare_orders=True)
    monkeypatch.setitem(PREPARED, "settings", special.to_dict())
    assert prepared_with()[0] == SETTINGS


def test_orbit_whose_fit_serves_is_not_fitted_again(prepared_with):
    fitted = FitSettings(order=4, prior_widths={"sources": 3.0})
    assert prepared_with(fitted)[0] is fitted


@pytest.mark.parametrize(
    "fitted",
    [
        FitSettings(order=2),
        FitSettings(order=3, aberration=False),
        FitSettings(order=3, exclusions=Exclusions(detectors=frozenset([1]))),
    ],
    ids=["lower-order", "other-model", "fewer-measurements"],
)
def test_fit_that_cannot_serve_is_replaced(prepared_with, fitted):
    assert prepared_with(fitted)[0] == SETTINGS


@pytest.mark.parametrize(
    ("change", "is_fitted"),
    [
        ({"do": "fit", "what_if": True}, True),
        ({"do": "fit", "what_if": True, "orbit": 1}, False),
        ({"do": "fit", "what_if": False}, False),
        ({"do": "prepare", "orbit": 1}, False),
        ({"do": "rest"}, False),
    ],
    ids=["its-what-if", "what-if-of-another-orbit", "fit", "another-orbit", "rest"],
)
def test_preparation_gives_way_to_all_but_its_what_ifs(prepared_with, requests, change, is_fitted):
    requests.put({**PREPARED, **change})
    assert (prepared_with()[0] is not None) == is_fitted


def test_what_if_of_a_prepared_orbit_needs_no_fit(requests, small_survey):
    """As for a solution of a run, of which no process has a fit in memory."""
    settings = FitSettings()
    origin = origin_to_dict(SurveyFolder(str(small_survey)))
    request = {**PREPARED, "origin": origin, "settings": settings.to_dict()}
    later = settings.with_(prior_widths={"sources": 3.0})
    kept = Fitters()
    assert kept.of(request).what_if(later) is None
    next(prepare(kept, request, requests))
    assert kept.of(request).what_if(later).summary["reason"] == FitStatus.WHAT_IF.value


def test_what_is_wrong_with_an_orbit_is_not_said_unasked(monkeypatch, requests):
    def unreadable(request):
        raise InputError("obs.fits: no such file")

    kept = Fitters()
    monkeypatch.setattr(kept, "of", unreadable)
    assert list(prepare(kept, PREPARED, requests)) == []


def test_as_many_orbits_are_kept_as_there_is_room_for(small_survey):
    origin = origin_to_dict(SurveyFolder(str(small_survey)))
    requests = [{"origin": origin, "orbit": orbit} for orbit in (0, 1, 0)]
    two, one = Fitters(most=2), Fitters(most=1)
    first, _, again = map(two.of, requests)
    assert again is first
    first, _, again = map(one.of, requests)
    assert again is not first


def test_only_the_latest_orbits_keep_lower_orders(small_survey, monkeypatch):
    """They take as much memory as all else that is kept of an orbit."""
    forgetful = []
    monkeypatch.setattr(OrbitFitter, "forget_precomputed", lambda one: forgetful.append(one))
    monkeypatch.setattr(fitters, "_WITH_LOWER_ORDERS", 1)
    origin = origin_to_dict(SurveyFolder(str(small_survey)))
    kept = Fitters(most=2)
    first, second, _ = (kept.of({"origin": origin, "orbit": orbit}) for orbit in (0, 1, 0))
    assert forgetful == [first, second]
