"""Surveys, orbits and sources in a notebook, with a real solver process."""

import asyncio
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import astropy.units as u
import pytest
from bokeh.document import Document
from panel.io.state import set_curdoc

import plateviz
from plateviz.notebook.orbit import OpenOrbit
from plateviz.notebook.solution import OpenSolution
from plateviz.notebook.survey import OpenSurvey
from solver.errors import CancelledError, FitError, InputError

REPOSITORY = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def survey(made_survey):
    with plateviz.open(made_survey) as opened:
        yield opened


@pytest.fixture(scope="module")
def orbit(survey):
    return survey.orbit(1)


@pytest.fixture(scope="module")
def solution(orbit):
    return orbit.fit()


def test_survey_opens_without_a_run(survey, made_survey):
    assert isinstance(survey, OpenSurvey)
    assert repr(survey) == f"Survey {made_survey.name} (3 orbits, not fitted as a whole)"
    assert survey.orbits["orbit_id"].tolist() == [0, 1, 2]
    assert survey.runs == []
    assert "Orbits" in survey._repr_html_()


def test_survey_has_its_catalogue_with_units(survey):
    assert survey.table("catalogue")["parallax"].unit == u.mas
    assert len(survey.table("truth")) == len(survey.table("catalogue"))


def test_orbit_has_its_input_tables(survey):
    orbit = survey.orbit(0)
    assert list(orbit.tables) == ["measurements", "exposures", "catalogue", "truth"]
    assert orbit.table("measurements")["nx"].unit == u.pix
    assert "not fitted" in orbit._repr_html_()
    with pytest.raises(InputError, match=r"orbit 0 of .*: expected a solution, found none yet"):
        orbit.what_if(order=3)


def test_orbit_is_fitted(solution, orbit):
    assert solution.summary["converged"]
    assert solution.settings.order == 5
    assert orbit.solution is solution
    assert "fitted, order 5" in orbit._repr_html_()


def test_what_if_is_compared_with_its_solution(solution, orbit):
    other = solution.what_if(order=3, priors={"distortion_x": "10um"})
    assert other.settings.order == 3
    assert other.settings.prior_widths == {"distortion_x": 10.0}
    assert other.other is solution
    assert other.summary["chi2"] > solution.summary["chi2"]
    assert "comparison" in other.figures
    assert orbit.solution is solution


def test_what_if_starts_from_the_settings_of_its_solution(solution, orbit):
    third = solution.what_if(order=3)
    assert third.what_if(exclude="detector=1").settings.order == 3
    assert orbit.what_if(exclude="detector=1").settings.order == 5


def test_invalid_setting_changes_nothing(solution, orbit):
    with pytest.raises(InputError, match="order from 0 to 9"):
        orbit.fit(order=11)
    with pytest.raises(InputError, match="some measurements of orbit 1 to remain"):
        orbit.fit(exclude=[f"detector={number}" for number in range(4)])
    assert orbit.solution is solution


@pytest.mark.slow
def test_files_of_an_orbit_open_and_fit(sample_orbit_dir):
    files = [sample_orbit_dir / f"sample_{name}.fits" for name in ("obs", "ref", "truth")]
    with plateviz.open(*files[:2], truth=files[2]) as orbit:
        assert isinstance(orbit, OpenOrbit)
        assert orbit.fit().summary["converged"]
        assert orbit.solution.result.true_places is not None


def test_closed_survey_starts_its_solver_again(survey, solution):
    survey.close()
    assert not survey._solver._started
    assert survey.orbit(1).fit(order=4).summary["converged"]


def test_dashboard_of_a_served_page_ends_with_its_session(survey):
    document = Document()

    async def serve():
        with set_curdoc(document):
            return survey.dashboard().__panel__()

    # As on a server, where a loop runs. This thread may have one for browser tests.
    with ThreadPoolExecutor(1) as thread:
        part = thread.submit(lambda: asyncio.run(serve())).result()
    assert [type(column).__name__ for column in part] == ["Column", "Column"]
    assert survey._solver._started
    for end in document.callbacks.session_destroyed_callbacks:
        end(None)
    assert not survey._solver._started


def test_interrupted_cell_cancels_its_job(survey, monkeypatch):
    jobs = []

    def interrupt(self, job):
        jobs.append(job)
        raise KeyboardInterrupt

    monkeypatch.setattr("plateviz.solving.progress.Reporter.follow", interrupt)
    with pytest.raises(KeyboardInterrupt):
        survey.orbit(2).fit(order=7)
    jobs[0].wait(30)
    with pytest.raises(CancelledError, match="stopped"):
        jobs[0].require_done()


def test_fit_fails_if_the_solver_process_ends(survey, monkeypatch):
    def kill(self, job):
        job.wait_for_news(0, 30)
        survey._solver.store._solver._process.kill()
        job.wait(30)

    monkeypatch.setattr("plateviz.solving.progress.Reporter.follow", kill)
    with pytest.raises(FitError, match="the solver process ended"):
        survey.orbit(2).fit(order=6)


def test_solver_ends_with_the_interpreter(made_survey, tmp_path):
    code = (
        f"import plateviz; survey = plateviz.open({str(made_survey)!r})\n"
        "store = survey._solver.store; print(store._solver._process.pid, store._scratch)"
    )
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    run = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    pid, scratch = run.stdout.split()
    assert not Path(scratch).exists()
    for _ in range(100):
        if not Path(f"/proc/{pid}").exists():
            break
        time.sleep(0.1)
    else:
        pytest.fail("the solver process outlived the interpreter")


@pytest.mark.full
@pytest.mark.slow
def test_survey_is_fitted_and_a_source_followed(survey_folder, tmp_path):
    survey = plateviz.open(survey_folder).fit(run="third", workers=2, order=3)
    assert survey.run_name == "third"
    assert (survey.orbits["status"] == "complete").all()
    assert survey.verdict.headline in survey._repr_html_()
    assert survey.orbit(2).solution.settings.order == 3
    assert isinstance(survey.orbit(2).what_if(order=2), OpenSolution)
    star = survey.source(survey.sources.iloc[0]["id"])
    assert len(star.history) == 3
    assert star.table()["offset_ra"].unit == u.mas
    assert list(star.motion["parameter"])[2] == "parallax"
    assert len(star.time_series) > 3
    assert star.report(tmp_path / "star.html").stat().st_size > 100_000
    assert survey.report(tmp_path / "survey.html").stat().st_size > 100_000
    for figures in (star.figures, survey.figures):
        assert all(figures[name].__panel__() is not None for name in figures)
    with pytest.raises(InputError, match="other settings"):
        survey.fit(run="third", order=4)
    with pytest.raises(InputError, match="orbits of the survey, 0 to 2, found 7"):
        survey.fit(orbits=[7])
    assert survey.runs == ["third"]
    survey.close()
