"""The solution store with a real solver process, which fits, cancels, dies and restarts."""

import json
import shutil
import signal
import tempfile
import time
from functools import partial

import pandas as pd
import pytest
from astropy.io import fits

from plateviz.runs.fitted_orbit import write_fitted_orbit
from plateviz.runs.new_run import begin_run
from plateviz.runs.scratch_result import (
    are_eigenmodes_to_come,
    are_eigenmodes_written,
    is_verdict_written,
    read_scratch_result,
    request_eigenmodes,
)
from plateviz.runs.worker_scratch import worker_scratch
from plateviz.solving import scratch_results, solver_queue
from plateviz.solving.job import Job, JobStatus
from plateviz.solving.origin import OrbitFiles, SurveyFolder, origin_from_dict, origin_to_dict
from plateviz.solving.solution_store import SolutionStore
from plateviz.solving.solver_queue import SolverQueue
from plateviz.verdict.verdict import with_verdict
from solver.data.result import FitStatus
from solver.data.settings import FitSettings
from solver.data.subset import Subset
from solver.errors import InputError
from solver.fit import OrbitFitter
from tests.solver.growing_survey import GrowingSurvey

LONG = 120


@pytest.fixture(scope="module")
def store(small_survey):
    store = SolutionStore(SurveyFolder(str(small_survey)), SolverQueue())
    yield store
    store.close()


def plain(values):
    return json.loads(json.dumps(values))


def test_orbit_is_fitted_and_kept(store):
    job = store.request(0, FitSettings())
    assert job.wait(LONG) is JobStatus.DONE, job.message
    result = store.result(0, FitSettings())
    assert result.summary["converged"]
    assert result.true_places is not None
    # It follows, and is waited for.
    assert result.summary["verdict"] == plain(with_verdict(result).summary["verdict"])
    stages = [report["stage"] for report in job.progress]
    assert stages[0] == "reading the orbit"
    assert "iteration 1" in stages


def test_same_request_returns_the_same_job(store):
    first = store.request(0, FitSettings())
    assert store.request(0, FitSettings()) is first
    assert store.request(1, FitSettings()) is not first


def test_other_settings_give_another_solution(store):
    settings = FitSettings(order=3, prior_widths={"distortion_x": 10.0})
    assert store.result(0, settings) is None
    assert store.request(0, settings).wait(LONG) is JobStatus.DONE
    other = store.result(0, settings)
    assert other.settings == settings
    assert other.summary["chi2"] > store.result(0, FitSettings()).summary["chi2"]


def test_invalid_input_is_reported(tmp_path, sample_orbit_dir):
    files = OrbitFiles(str(sample_orbit_dir / "sample_obs.fits"), str(tmp_path / "none.fits"))
    store = SolutionStore(files, SolverQueue())
    try:
        job = store.request(None, FitSettings())
        assert job.wait(LONG) is JobStatus.FAILED
        assert "none.fits" in job.message
    finally:
        store.close()


def test_cancelled_fit_ends_and_can_be_requested_again(store):
    settings = FitSettings(order=7)
    job = store.request(1, settings)
    job.wait_for_news(0, timeout=LONG)
    store.cancel(job)
    assert job.wait(LONG) is JobStatus.CANCELLED
    assert store.result(1, settings) is None
    again = store.request(1, settings)
    assert again is not job
    assert again.wait(LONG) is JobStatus.DONE


def test_job_goes_on_until_nobody_holds_it(store):
    settings = FitSettings(order=7, prior_widths={"sources": 3.0})
    job = store.request(1, settings)
    assert store.request(1, settings) is job
    assert not store.cancel(job)
    # The other page is closed, and loaded again.
    store.abandon(job)
    assert store.request(1, settings) is job
    assert job.wait(LONG) is JobStatus.DONE


def test_waiting_job_is_cancelled_before_it_starts(store):
    first = store.request(0, FitSettings(order=4))
    waiting = store.request(0, FitSettings(order=2))
    store.cancel(waiting)
    assert waiting.status is JobStatus.CANCELLED
    assert waiting.progress == []
    assert first.wait(LONG) is JobStatus.DONE


def test_request_to_a_process_that_has_just_died_fails(store):
    solver = store._solver
    # While the lock is held, the listener cannot notice the end of the process.
    with solver._lock:
        solver._process.kill()
        solver._process.wait()
        job = store.request(0, FitSettings(order=1))
    assert job.wait(LONG) is JobStatus.FAILED
    assert "the solver process ended" in job.message
    assert store.request(0, FitSettings(order=1)).wait(LONG) is JobStatus.DONE


def test_process_that_dies_is_reported_and_replaced(store):
    job = store.request(1, FitSettings(order=6))
    job.wait_for_news(0, timeout=LONG)
    store._solver._process.kill()
    assert job.wait(LONG) is JobStatus.FAILED
    assert "the solver process ended" in job.message
    assert store.request(1, FitSettings(order=6)).wait(LONG) is JobStatus.DONE


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="no process can be stopped here")
def test_process_that_does_not_give_up_a_fit_is_replaced(store, monkeypatch):
    monkeypatch.setattr(solver_queue, "_GRACE_SECONDS", 0.2)
    settings = FitSettings(order=6, prior_widths={"sources": 4.0})
    job = store.request(1, settings)
    store._solver._process.send_signal(signal.SIGSTOP)
    store.cancel(job)
    # Nobody waits for the process.
    assert job.status is JobStatus.CANCELLED
    assert store.request(1, settings).wait(LONG) is JobStatus.DONE


def test_solution_that_made_room_for_others_is_computed_again(store, monkeypatch):
    monkeypatch.setattr(store._results, "_most_bytes", 1)
    monkeypatch.setattr(scratch_results, "_LEAST", 1)
    first = store.request(0, FitSettings(order=1))
    assert first.wait(LONG) is JobStatus.DONE
    store.request(0, FitSettings(order=2))
    assert store.result(0, FitSettings(order=1)) is None
    again = store.request(0, FitSettings(order=1))
    assert again is not first
    assert again.wait(LONG) is JobStatus.DONE
    assert store.result(0, FitSettings(order=1)) is not None


def test_closing_cancels_jobs_and_removes_solutions(small_survey):
    store = SolutionStore(SurveyFolder(str(small_survey)), SolverQueue())
    job = store.request(0, FitSettings())
    scratch = store._scratch
    store.close()
    assert job.status is JobStatus.CANCELLED
    assert not scratch.exists()


def test_orbits_are_those_that_the_survey_has_by_now(small_survey, tmp_path):
    growing = GrowingSurvey(small_survey, tmp_path / "survey", 1)
    store = SolutionStore(SurveyFolder(str(growing.directory)), SolverQueue())
    try:
        assert store.orbits == [0]
        growing.append(1)
        assert store.orbits == [0, 1]
        (growing.directory / "survey.toml").unlink()
        assert store.orbits == [0, 1]
    finally:
        store.close()


def test_unexpected_exception_does_not_block_the_queue(small_survey):
    solver = SolverQueue()
    try:
        broken = solver.submit(Job({"do": "nothing of the kind"}))
        assert broken.wait(LONG) is JobStatus.FAILED
        assert "KeyError" in broken.message
    finally:
        solver.close()


@pytest.mark.parametrize(
    "origin",
    [
        OrbitFiles("obs.fits", "ref.fits", orbit=3, instrument="camera.toml"),
        SurveyFolder("somewhere"),
    ],
    ids=["files", "survey"],
)
def test_origin_is_converted_to_plain_values_and_back(origin):
    assert origin_from_dict(origin_to_dict(origin)) == origin


def test_folder_without_a_survey_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"survey\.toml"):
        SurveyFolder(str(tmp_path)).orbits()


def test_what_if_is_a_step_from_the_last_fit(store):
    assert store.request(0, FitSettings()).wait(LONG) is JobStatus.DONE
    settings = FitSettings(prior_widths={"sources": 2.0})
    # The fitter of an orbit starts from its own last fit.
    job = store.request(0, settings, what_if=True)
    assert job.wait(LONG) is JobStatus.DONE, job.message
    assert store.result(0, settings) is None
    result = store.result(0, settings, what_if=True)
    assert result.summary["converged"]
    # They follow, and are those that the step would have given at once.
    fitter = OrbitFitter(store.origin.read(0), store.instrument)
    fitter.fit(FitSettings())
    expected = fitter.what_if(settings)
    for name in ("eigenmodes", "mode_parameters", "mode_shifts"):
        assert len(getattr(result, name)) == len(getattr(expected, name))
    pd.testing.assert_frame_equal(
        result.eigenmodes[["mode", "name"]], expected.eigenmodes[["mode", "name"]]
    )


def test_likely_what_if_is_there_when_it_is_asked_for(store):
    settings = FitSettings(order=4)
    assert store.request(1, settings).wait(LONG) is JobStatus.DONE
    likely = settings.with_(order=3)
    store.prepare(1, settings, [likely], may_fit=False)
    end = time.monotonic() + LONG
    while store.result(1, likely, what_if=True) is None and time.monotonic() < end:
        time.sleep(0.02)
    job = store.request(1, likely, what_if=True)
    assert job.status is JobStatus.DONE
    assert job.progress == []
    result = store.result(1, likely, what_if=True)
    assert result.summary["reason"] == FitStatus.WHAT_IF.value
    assert result.summary["verdict"] == plain(with_verdict(result).summary["verdict"])
    # Nobody may have asked for it: its eigenmodes are made now.
    assert len(result.eigenmodes) > 0


def test_eigenmodes_that_were_given_up_are_computed_when_asked_for(store):
    assert store.request(0, FitSettings()).wait(LONG) is JobStatus.DONE
    settings = FitSettings(prior_widths={"sources": 2.5})
    assert store.request(0, settings, what_if=True).wait(LONG) is JobStatus.DONE
    directory = store._directory(0, settings, what_if=True)
    names = ("eigenmodes", "mode_parameters", "mode_shifts")
    before = {name: getattr(store.result(0, settings, what_if=True), name) for name in names}
    for name in names:
        (directory / f"{name}.arrow").unlink()
    again = read_scratch_result(directory, partial(store._complete, directory))
    assert are_eigenmodes_to_come(again)
    for name in names:
        pd.testing.assert_frame_equal(getattr(again, name), before[name])
    assert not are_eigenmodes_to_come(again)


def test_what_a_process_had_put_off_when_it_died_is_computed_by_the_next_one(store):
    settings = FitSettings(order=4)
    assert store.request(0, settings).wait(LONG) is JobStatus.DONE
    likely, died = settings.with_(order=3), store._solver._process
    assert store.request(0, likely, what_if=True).wait(LONG) is JobStatus.DONE
    died.kill()
    directory, end = store._directory(0, likely, what_if=True), time.monotonic() + LONG
    while store._solver._process is died and time.monotonic() < end:
        time.sleep(0.02)
    assert not is_verdict_written(directory)
    assert not are_eigenmodes_written(directory)
    request_eigenmodes(store.result(0, likely, what_if=True))
    # A new process takes seconds.
    while not are_eigenmodes_written(directory) and time.monotonic() < end:
        time.sleep(0.02)
    result = store.result(0, likely, what_if=True)
    assert result.summary["verdict"] == plain(with_verdict(result).summary["verdict"])
    assert len(result.eigenmodes) > 0


def test_what_if_without_sources_starts_from_all_measurements(store):
    """As for a solution of a run, of which the solver has no fit yet."""
    sources = store.origin.read(1).measurements["source_id"].unique().tolist()
    for excluded in (sources[:3], sources[3:6]):
        settings = FitSettings(exclusions=Subset(frozenset(excluded)))
        job = store.request(1, settings, what_if=True)
        assert job.wait(LONG) is JobStatus.DONE, job.message
        result = store.result(1, settings, what_if=True)
        assert result.summary["reason"] == FitStatus.WHAT_IF.value
        assert not result.sources["source_id"].isin(excluded).any()


@pytest.mark.parametrize("damaged", [(), ("calibration", "sources")], ids=["whole", "damaged"])
def test_what_if_of_an_orbit_of_a_run_starts_from_its_solution(small_survey, tmp_path, damaged):
    survey = tmp_path / "survey"
    shutil.copytree(small_survey, survey)
    fitted, settings = FitSettings(), FitSettings(order=3, prior_widths={"sources": 2.0})
    origin = SurveyFolder(str(survey))
    run = begin_run(survey, "default", fitted)
    write_fitted_orbit(run.orbit_directory(0), OrbitFitter(origin.read(0)).fit(fitted))
    for name in damaged:
        (run.orbit_directory(0) / f"{name}.parquet").write_bytes(b"PAR1")
    store = SolutionStore(origin, SolverQueue())
    try:
        job = store.request(0, settings, what_if=True)
        assert job.wait(LONG) is JobStatus.DONE, job.message
        # A fit of its own has more stages, and another reason.
        steps = [report["stage"] for report in job.progress if "iteration" in report["stage"]]
        assert (len(steps) > 2) == bool(damaged)
        result = store.result(0, settings, what_if=True)
        assert result.summary["reason"] == FitStatus.WHAT_IF.value
        # The next ones need no fit either, of whatever order.
        later = settings.with_(order=5)
        assert store.request(0, later, what_if=True).wait(LONG) is JobStatus.DONE
        assert store.result(0, later, what_if=True).summary["reason"] == FitStatus.WHAT_IF.value
    finally:
        store.close()


def test_what_if_beyond_a_step_is_fitted(store):
    settings = FitSettings(order=6)
    assert store.request(0, settings, what_if=True).wait(LONG) is JobStatus.DONE
    result = store.result(0, settings, what_if=True)
    assert result.summary["reason"].startswith("every step of the last iteration")


def test_closed_solver_removes_what_ended_workers_left_only(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with worker_scratch() as of_another_survey:
        left = of_another_survey.path.with_name("plateviz-workers-0123456789ab.part")
        (left / "dask-scratch-space").mkdir(parents=True)
        SolverQueue().close()
        assert not left.exists()
        assert of_another_survey.path.is_dir()


def test_closed_solver_starts_no_process_for_those_who_still_ask(tmp_path, monkeypatch):
    solver = SolverQueue()
    solver.close()
    monkeypatch.setattr(SolverQueue, "_start", lambda _: pytest.fail("started a process"))
    solver.prepare({"orbit": 0})
    assert solver.submit(Job({"do": "fit"})).status is JobStatus.CANCELLED
    assert solver.jobs == []


def test_files_that_are_replaced_are_read_again(tmp_path, sample_orbit_dir):
    files = OrbitFiles(*(str(tmp_path / f"sample_{name}.fits") for name in ("obs", "ref")))
    for name in ("sample_obs.fits", "sample_ref.fits"):
        shutil.copy(sample_orbit_dir / name, tmp_path / name)
    store, settings = SolutionStore(files, SolverQueue()), FitSettings(order=3)
    try:
        assert store.request(None, settings).wait(LONG) is JobStatus.DONE
        before = store.result(None, settings)
        with fits.open(files.reference) as tables:
            tables[1].data["ra_error"] *= 2.0
            tables.writeto(tmp_path / "new.fits")
        (tmp_path / "new.fits").replace(files.reference)
        assert store.result(None, settings) is None
        assert store.request(None, settings).wait(LONG) is JobStatus.DONE
        after = store.result(None, settings)
        assert after.provenance != before.provenance
        widest = (one.sources["prior_sigma_ra"].max() for one in (before, after))
        assert next(widest) < 0.6 * next(widest)
    finally:
        store.close()
