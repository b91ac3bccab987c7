"""Preparation: fits and what-ifs that the solver process makes before they are asked for."""

import queue

import jax
import pytest

from plateviz.runs.scratch_result import is_judged_later, is_written, read_scratch_result
from plateviz.solving.fitters import Fitters
from plateviz.solving.origin import SurveyFolder, origin_to_dict
from plateviz.solving.preparation import get_ready, prepare
from plateviz.solving.put_off import PutOff
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.errors import InputError
from solver.runtime.interruption import give_way


@pytest.fixture
def requests():
    return queue.Queue()


class Fitter:
    """An orbit's fitter without an orbit: a fit takes its settings and gives way once."""

    def __init__(self, fitted):
        self.fitted_settings = fitted

    def prepare_what_ifs(self, settings, solution):
        give_way()
        self.started_from = solution
        self.fitted_settings = settings

    def precompute(self, order):
        yield from range(order)


SETTINGS = FitSettings(order=3)
PREPARED = {
    "do": "prepare",
    "origin": "here",
    "orbit": 0,
    "settings": SETTINGS.to_dict(),
    "may_fit": True,
    "only_fit": False,
    "is_urgent": False,
    "likely": [],
}


@pytest.fixture
def prepared_with(monkeypatch, requests):
    """Prepare an orbit that was fitted with some settings, or not; return the settings then."""

    def prepared(fitted=None):
        fitter, kept = Fitter(fitted), Fitters()
        monkeypatch.setattr(kept, "of", lambda request: fitter)
        prepared = prepare(kept, PREPARED, requests, PutOff())
        list(prepared.soon)
        return fitter.fitted_settings, list(prepared.later)

    return prepared


def test_orbit_is_fitted_and_its_likely_what_ifs_are_precomputed(prepared_with):
    assert prepared_with() == (SETTINGS, [0, 1, 2])


def test_all_measurements_are_fitted_and_no_orders_compared(prepared_with, monkeypatch):
    special = SETTINGS.with_(exclusions=Subset(detectors=frozenset([1])), compare_orders=True)
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
        FitSettings(order=3, exclusions=Subset(detectors=frozenset([1]))),
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
    next(prepare(kept, request, requests, PutOff()).soon)
    assert kept.of(request).what_if(later).summary["reason"] == FitStatus.WHAT_IF.value


def test_orbit_gets_ready_with_the_solution_of_a_run(small_survey, tmp_path, caplog):
    settings = FitSettings(order=2)
    base = {"settings": settings.to_dict(), "directory": str(tmp_path / "unread")}
    origin = origin_to_dict(SurveyFolder(str(small_survey)))
    request = {"do": "get ready", "origin": origin, "orbit": 0, "base": base}
    kept = Fitters()
    jax.clear_caches()
    after = get_ready(kept, request)
    assert [*after.soon, *after.later] == []
    assert kept.of(request).fitted_settings == settings
    with jax.log_compiles():
        assert kept.of(request).what_if(settings.with_(prior_widths={"sources": 3.0})) is not None
    assert [record for record in caplog.records if "Compiling" in record.msg] == []


def test_what_is_wrong_with_an_orbit_is_not_said_unasked(monkeypatch, requests):
    def unreadable(request):
        raise InputError("obs.fits: no such file")

    kept = Fitters()
    monkeypatch.setattr(kept, "of", unreadable)
    prepared = prepare(kept, PREPARED, requests, PutOff())
    assert [*prepared.soon, *prepared.later] == []


def test_orbit_is_not_fitted_unasked(prepared_with, monkeypatch):
    """A solution of the solver's own may be of fewer measurements, which a fit would replace."""
    monkeypatch.setitem(PREPARED, "may_fit", False)
    assert prepared_with()[0] is None


def test_orbit_is_fitted_without_what_may_never_be_asked_for(
    prepared_with, likely, requests, tmp_path, monkeypatch
):
    fitters, request = likely
    list(prepare(fitters, {**request, "only_fit": True}, requests, PutOff()).soon)
    assert not is_written(tmp_path / "lower")
    monkeypatch.setitem(PREPARED, "only_fit", True)
    assert prepared_with() == (SETTINGS, [])


@pytest.fixture
def likely(small_survey, tmp_path):
    """A fitted orbit, and a request to prepare two what-ifs of which the first is impossible."""
    origin = origin_to_dict(SurveyFolder(str(small_survey)))
    settings = FitSettings(order=3)
    nowhere = settings.with_(exclusions=Subset(sources=frozenset([-1])))
    wanted = [
        {"settings": one.to_dict(), "directory": str(tmp_path / name)}
        for name, one in (("nowhere", nowhere), ("lower", settings.with_(order=2)))
    ]
    request = {**PREPARED, "origin": origin, "likely": wanted}
    fitters = Fitters()
    fitters.of(request).prepare_what_ifs(settings)
    return fitters, request


def test_likely_what_ifs_are_made(likely, requests, tmp_path):
    fitters, request = likely
    put_off = PutOff()
    steps = prepare(fitters, request, requests, put_off).soon
    # The fit serves; then the first what-if, which nobody hears of, and the second one.
    for _ in range(3):
        next(steps)
    assert not is_written(tmp_path / "nowhere")
    made = read_scratch_result(tmp_path / "lower")
    assert is_judged_later(made)
    expected = fitters.of(request).what_if(made.settings)
    assert made.summary["chi2"] == expected.summary["chi2"]
    assert made.summary["reason"] == FitStatus.WHAT_IF.value
    assert list(steps) == []
    assert not is_judged_later(made)


def test_likely_what_if_goes_on_while_it_is_all_that_is_asked_for(likely, requests, tmp_path):
    fitters, request = likely
    asked = {**request, "do": "fit", "what_if": True}
    requests.put({**asked, "directory": request["likely"][1]["directory"]})
    steps = prepare(fitters, {**request, "may_fit": False}, requests, PutOff()).soon
    # Nothing of this first one is computed.
    next(steps)
    next(steps)
    assert is_written(tmp_path / "lower")


def test_likely_what_if_gives_way_to_others(likely, requests, tmp_path):
    fitters, request = likely
    requests.put({**request, "do": "fit", "what_if": True, "directory": "another"})
    assert len(list(prepare(fitters, request, requests, PutOff()).soon)) < 3
    assert not is_written(tmp_path / "lower")


def test_what_a_page_that_opens_has_interrupted_is_made_later(likely, requests, tmp_path):
    fitters, request = likely
    requests.put({"do": "pause", "seconds": 2.0})
    prepared = prepare(fitters, {**request, "is_urgent": True}, requests, PutOff())
    list(prepared.soon)
    assert not is_written(tmp_path / "lower")
    requests.get()
    paused = prepared.paused(2.0)
    assert (paused.is_urgent, paused.pause) == (False, 2.0)
    list(paused.soon)
    assert is_written(tmp_path / "lower")


def test_what_needs_a_fit_is_not_made(likely, requests, tmp_path):
    fitters, request = likely
    higher = {"settings": FitSettings(order=5).to_dict(), "directory": str(tmp_path / "higher")}
    list(prepare(fitters, {**request, "likely": [higher]}, requests, PutOff()).soon)
    assert not is_written(tmp_path / "higher")
