"""`plateviz demo`: what it simulates, what it fits, and what it leaves alone."""

import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from plateviz.cli import demo
from plateviz.cli.demo import BackgroundFit, demo_directory, make_survey, request_first_orbit
from plateviz.runs.run import Run
from plateviz.runs.run_directory import DEFAULT_RUN, RunDirectory
from plateviz.solving.job import Job
from plateviz.solving.origin import SurveyFolder
from plateviz.solving.progress import reporting
from plateviz.solving.solution_store import SolutionStore
from plateviz.solving.solver_queue import SolverQueue
from solver.data.settings import FitSettings
from solver.errors import FitError
from solver.io.lock import locked
from solver.io.scratch import is_scratch
from solver.simulate.schedule import schedule
from solver.simulate.seasons import SEASONS
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

SMALL = SurveySettings(orbits=2, seed=3).scaled(4_000)
# The fit gives way to whatever runs beside it: it takes seconds alone, and minutes beside tests.
LONGEST_FIT_S = 600


class NoSolver:
    """Fails the test if anything is asked of it."""

    def submit(self, job):
        pytest.fail(f"expected no request, found {job.request}")

    def complete(self, job, part):
        pytest.fail("expected no request")


class DeadSolver:
    """A solver process that ends at each request."""

    def submit(self, job):
        job.fail("the solver process ended (exit -9): no message")
        return job


@pytest.fixture
def small(monkeypatch, tmp_path):
    """The demo with a smaller survey, in a cache of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(demo, "DEMO", SMALL)
    return demo_directory()


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """The folder of the smaller demo with its survey, and nothing fitted."""
    directory = tmp_path_factory.mktemp("demo") / "demo"
    simulate_survey(directory, SMALL)
    return directory


@pytest.fixture
def made(small, simulated):
    """The run of a survey that was made for the demo."""
    shutil.copytree(simulated, small)
    with reporting("simulating") as reporter:
        return make_survey(small, NoSolver(), reporter)


def files(directory):
    return {path: path.stat().st_mtime_ns for path in directory.rglob("*")}


def test_survey_spreads_over_all_seasons():
    starts = schedule(demo.DEMO).groupby("orbit_id")["obstime"].min().to_numpy()
    edges = np.array([(season.start_mjd, season.end_mjd) for season in SEASONS])
    in_season = (starts[:, None] >= edges[:, 0]) & (starts[:, None] < edges[:, 1])
    assert len(starts) >= 30
    assert in_season.any(axis=1).all()
    assert in_season.sum(axis=0).min() >= 5


def test_another_survey_or_version_has_a_folder_of_its_own(small, monkeypatch):
    monkeypatch.setattr(demo, "versions_of", lambda packages: dict.fromkeys(packages, "99"))
    upgraded = demo_directory()
    monkeypatch.setattr(demo, "DEMO", SurveySettings(orbits=3, seed=3).scaled(4_000))
    assert len({small, upgraded, demo_directory()}) == 3


def test_dead_solver_process_ends_with_exit_code_one(small, run, monkeypatch):
    monkeypatch.setattr(SolverQueue, "submit", DeadSolver.submit)
    code, _, err = run("demo", "--port", "0", "--no-open")
    assert code == 1
    assert "the solver process ended" in err
    assert list(small.rglob("survey.toml")) == []


def test_dead_solver_process_is_no_input_error(small):
    with reporting("simulating") as reporter, pytest.raises(FitError):
        make_survey(small, DeadSolver(), reporter)


@pytest.mark.slow
def test_background_fit_completes_the_run_and_a_second_start_does_nothing(small, made, capsys):
    run = made
    fit = BackgroundFit(run, None)
    fit.start()
    fit._thread.join(LONGEST_FIT_S)
    assert run.is_complete
    assert run.complete_orbits() == [0, 1]
    assert "has fitted all orbits" in capsys.readouterr().out
    assert Run(run).motions()["rms_truth_2d"].notna().all()

    before = files(small)
    with reporting("simulating") as reporter:
        again = make_survey(small, NoSolver(), reporter)
    store = SolutionStore(SurveyFolder(str(small)), NoSolver())
    assert request_first_orbit(store, again) is None
    fit = BackgroundFit(again, None)
    fit.start()
    fit.close()
    assert files(small) == before


@pytest.mark.full
@pytest.mark.slow
def test_closed_background_fit_is_resumed(made):
    run = made
    fit = BackgroundFit(run, None)
    fit.start()
    wait_until(lambda: run.complete_orbits())
    fit.close()
    assert not fit._thread.is_alive()
    first = files(run.orbit_directory(0))
    rest = BackgroundFit(run, None)
    rest.start()
    rest._thread.join(LONGEST_FIT_S)
    assert run.is_complete
    assert files(run.orbit_directory(0)) == first


def test_background_fit_waits_for_the_first_orbit_and_ends_when_closed(small, monkeypatch):
    monkeypatch.setattr(demo, "SolverQueue", lambda *_: pytest.fail("expected no second solver"))
    first = Job({"do": "fit"})
    fit = BackgroundFit(RunDirectory(small, DEFAULT_RUN), first)
    fit.start()
    fit_thread = fit._thread
    assert fit_thread.is_alive()
    with fit._lock:
        fit._is_closed = True
    first.cancel()
    fit_thread.join(10)
    assert not fit_thread.is_alive()


@pytest.mark.slow
def test_second_process_does_not_fit_the_same_run(made, capsys):
    with locked(made.directory) as is_ours:
        assert is_ours
        fit = BackgroundFit(made, None)
        fit.start()
        fit._thread.join(60)
    assert "another process is fitting" in capsys.readouterr().out
    assert made.complete_orbits() == []


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
@pytest.mark.parametrize(
    "number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.full)]
)
def test_processes_and_scratch_folders_end_with_the_server(made, number, tmp_path):
    """Whatever ends the server, nothing that it started goes on, and nothing is left."""
    scratch, errors = tmp_path / "scratch", tmp_path / "errors"
    scratch.mkdir()
    code = (
        "from plateviz.cli import demo, main\n"
        "from solver.simulate.settings import SurveySettings\n"
        "demo.DEMO = SurveySettings(orbits=2, seed=3).scaled(4_000)\n"
        "main.main()"
    )
    with errors.open("wb") as printed:
        server = subprocess.Popen(
            [sys.executable, "-c", code, "demo", "--port", "0", "--no-open"],
            stdout=subprocess.DEVNULL,
            stderr=printed,
            env={**os.environ, "PYTHONUNBUFFERED": "1", "TMPDIR": str(scratch)},
        )
    try:
        wait_until(lambda: len(descendants(server.pid)) >= 3)
        started = descendants(server.pid)
        server.send_signal(number)
        server.wait(30)
        wait_until(lambda: not any(map(is_running, started)), seconds=30)
    finally:
        server.kill()
    assert server.returncode == (143 if number == signal.SIGTERM else 0)
    assert "Traceback" not in errors.read_text()
    assert not [path for path in tmp_path.rglob("*") if is_scratch(path.name)]
    assert made.settings() == FitSettings()


def wait_until(condition, seconds=90):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def descendants(pid):
    """Return the ids of all processes that a process started, and those that they started."""
    listed = subprocess.run(["ps", "-eo", "pid=,ppid="], capture_output=True, text=True, check=True)
    pairs = [tuple(map(int, line.split())) for line in listed.stdout.splitlines()]
    found = [pid]
    for parent in found:
        found += [child for child, of in pairs if of == parent]
    return found[1:]


def is_running(pid):
    listed = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True)
    return bool(listed.stdout.strip()) and not listed.stdout.startswith("Z")
