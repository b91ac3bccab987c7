"""A disk that is full or read-only, lost workers: told once and in words, and resumed."""

import errno
import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from distributed import KilledWorker, LocalCluster

from plateviz.runs import dask_workers, fit_survey
from plateviz.runs.new_run import begin_run
from plateviz.runs.run_directory import RunDirectory
from solver.data.settings import FitSettings
from solver.errors import DiskError, FitError, InputError
from solver.io.lock import locked
from solver.io.result import write_result
from solver.simulate.settings import SurveySettings
from solver.simulate.survey import simulate_survey

SETTINGS = FitSettings()
FULL = OSError(errno.ENOSPC, "No space left on device")


@pytest.fixture
def in_threads(monkeypatch):
    """Let the worker be a thread of this process, in which a test may replace functions."""

    def cluster(**options):
        return LocalCluster(**{**options, "processes": False})

    monkeypatch.setattr(dask_workers, "LocalCluster", cluster)
    monkeypatch.setattr(dask_workers, "use_one_thread", lambda: None)


@pytest.fixture
def fit_as(monkeypatch, fit_result):
    """Return the function that replaces the fit of an orbit, given the run and the orbit."""

    def replace(fit):
        monkeypatch.setattr(dask_workers, "_fit", fit)
        monkeypatch.setattr(fit_survey, "gather", lambda _: None)
        monkeypatch.setattr(fit_survey, "close_run", lambda _: None)

    return replace


def names(folder):
    return sorted(path.name for path in folder.rglob("*"))


@pytest.mark.usefixtures("in_threads")
def test_full_disk_stops_the_survey_with_one_message(survey_folder, fit_as, fit_result):
    tried = []

    def fit(run, orbit):
        tried.append(orbit)
        if len(tried) == 2:
            fit_as(fails)
        run.keep(orbit, fit_result, {"history": fit_result.sources})

    def fails(run, orbit):
        tried.append(orbit)
        from plateviz.runs import fitted_orbit

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(fitted_orbit, "flush", full)
            run.keep(orbit, fit_result, {"history": fit_result.sources})

    def full(_):
        raise FULL

    fit_as(fails)
    with pytest.raises(DiskError, match=r"orbit=000\d: expected to write .* a full disk"):
        fit_survey.fit_survey(survey_folder, "full", SETTINGS, workers=1)
    assert len(tried) < 3
    run = RunDirectory(survey_folder, "full")
    assert names(run.directory) == ["run.toml"]
    tried.clear()
    fit_as(fit)
    with pytest.raises(DiskError, match=r"1 orbit is left, for about .* [kM]B more$"):
        fit_survey.fit_survey(survey_folder, "full", SETTINGS, workers=1)
    assert len(run.complete_orbits()) == 2
    assert run.failures() == {}
    tried.clear()
    fit_as(lambda run, orbit: run.keep(orbit, fit_result, {"history": fit_result.sources}))
    report = fit_survey.fit_survey(survey_folder, "full", SETTINGS, workers=1)
    assert (len(report.fitted), len(report.kept)) == (1, 2)


@pytest.mark.usefixtures("in_threads")
def test_error_of_a_disk_that_a_library_raises_stops_the_survey(survey_folder, fit_as):
    def fit(run, orbit):
        raise OSError(errno.EROFS, "Read-only file system")

    fit_as(fit)
    with pytest.raises(DiskError, match="found a read-only disk"):
        fit_survey.fit_survey(survey_folder, "read-only", SETTINGS, workers=1)


def test_read_only_survey_is_told(survey_folder, monkeypatch):
    def refuse(*_, **__):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr("pathlib.Path.mkdir", refuse)
    with pytest.raises(DiskError, match="expected to create the folder, found a read-only disk"):
        begin_run(survey_folder, "new", SETTINGS)


def test_full_disk_during_a_simulation_keeps_what_is_whole(tmp_path, monkeypatch):
    settings = SurveySettings(orbits=2, seed=3).scaled(1500)
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    simulate_survey(whole, settings)
    replace, count = os.replace, []

    def full(*paths):
        count.append(paths)
        if len(count) == 6:
            raise FULL
        replace(*paths)

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(DiskError, match=r"orbit=0001\.parquet: expected to write .* a full disk"):
        simulate_survey(cut, settings)
    assert not [name for name in names(cut) if name.endswith(".part")]
    simulate_survey(cut, settings)
    assert names(cut) == names(whole)
    for path in whole.rglob("*.*"):
        assert (cut / path.relative_to(whole)).read_bytes() == path.read_bytes()


def test_run_that_was_killed_while_it_began_is_begun(survey_folder):
    directory = survey_folder / "runs" / "killed"
    (directory / ".run.toml-0123456789ab.part").mkdir(parents=True)
    run = begin_run(survey_folder, "killed", SETTINGS)
    assert run.settings() == SETTINGS
    run.remove_abandoned()
    assert names(directory) == ["run.toml"]


def test_failure_of_an_orbit_that_was_fitted_since_is_removed(survey_folder, fit_result):
    run = begin_run(survey_folder, "failed", SETTINGS)
    run.keep(1, fit_result, {"history": fit_result.sources})
    run.keep_failure(1, "killed before this was removed")
    run.remove_abandoned()
    assert run.failures() == {}


def test_second_process_that_simulates_is_refused(tmp_path):
    with locked(tmp_path), pytest.raises(InputError, match="another process is simulating into"):
        simulate_survey(tmp_path, SurveySettings(orbits=1))
    assert list(tmp_path.iterdir()) == []


def test_second_repair_at_once_is_refused(survey_folder):
    run = begin_run(survey_folder, "one", SETTINGS)
    with locked(run.directory), pytest.raises(InputError, match="another process is fitting"):
        fit_survey.fit_survey(survey_folder, "one", SETTINGS, repair=True)


@pytest.mark.usefixtures("in_threads")
def test_clock_that_went_back_changes_nothing(survey_folder, fit_as, fit_result):
    fit_as(lambda run, orbit: run.keep(orbit, fit_result, {"history": fit_result.sources}))
    fit_survey.fit_survey(survey_folder, "clock", SETTINGS, [0, 1], workers=1)
    run = RunDirectory(survey_folder, "clock")
    future = time.time() + 10 * 365 * 86400
    for path in survey_folder.rglob("*"):
        os.utime(path, (future, future))
    before = {path: path.stat().st_mtime_ns for path in run.orbit_directory(1).iterdir()}
    report = fit_survey.fit_survey(survey_folder, "clock", SETTINGS, workers=1)
    assert (report.fitted, report.kept) == ([2], [0, 1])
    assert {path: path.stat().st_mtime_ns for path in run.orbit_directory(1).iterdir()} == before
    assert run.changes() == []


def test_orbit_that_kills_its_workers_is_told_in_words(tmp_path):
    error = KilledWorker("task", None, 3)
    message = dask_workers._reason(error, RunDirectory(tmp_path, "r"), 7)
    assert "orbit 7: expected a worker process that fits it, found that each of the 4" in message
    assert "--workers" in message


@pytest.mark.full
@pytest.mark.slow
def test_scheduler_that_is_lost_during_a_run_ends_it_in_words(survey_folder):
    code = (
        "from distributed import LocalCluster\n"
        "if __name__ == '__main__':\n"
        "    cluster = LocalCluster(n_workers=1, dashboard_address='127.0.0.1:0')\n"
        "    print(cluster.scheduler_address, flush=True)\n"
        "    input()\n"
    )
    script = survey_folder.parent / "cluster.py"
    script.write_text(code)
    command = [sys.executable, str(script)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        address = process.stdout.readline().strip()
        timer = threading.Timer(5.0, os.killpg, (process.pid, signal.SIGKILL))
        timer.start()
        with pytest.raises(FitError, match="connection to it was lost"):
            fit_survey.fit_survey(survey_folder, "lost", SETTINGS, scheduler=address)
        timer.join()


@pytest.fixture
def disk(tmp_path):
    """A small disk, and the function that changes its size or its other options."""
    if sys.platform != "linux" or os.geteuid() != 0:
        pytest.skip("only root may mount a disk")
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=40k", "none", str(folder)]
    if subprocess.run(mount, check=False).returncode:
        pytest.skip("no disk may be mounted here")

    def change(options):
        subprocess.run(["mount", "-o", f"remount,{options}", str(folder)], check=True)

    yield folder, change
    subprocess.run(["umount", str(folder)], check=True)


def told_once(outcome, folder):
    """Check that a command told of a full disk, once, and left nothing half-written."""
    code, _, err = outcome
    assert code == 2
    assert err.count("a full disk") == 1
    assert "Errno" not in err
    assert not [name for name in names(folder) if name.endswith(".part")]


@pytest.mark.full
@pytest.mark.slow
@pytest.mark.parametrize("size", [200, 700, 1200])
def test_small_disk_stops_a_simulation_and_a_survey_which_go_on(disk, run, size):
    folder, change = disk
    simulate = "simulate", folder / "survey", "--orbits", 3, "--stars", 6000
    fit = "survey", folder / "survey", "--workers", 1
    change(f"size={size}k")
    told_once(run(*simulate), folder)
    change("size=100m")
    assert run(*simulate)[0] == 0
    used = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    change(f"size={used // 1024 + size + 200}k")
    told_once(run(*fit), folder)
    change("size=100m")
    assert run(*fit)[0] == 0
    change("ro")
    assert run(*fit)[0] == 0
    code, _, err = run(*fit, "--run", "other")
    assert code == 2
    assert "a read-only disk" in err


@pytest.mark.full
@pytest.mark.slow
def test_small_disk_stops_a_fit_and_a_report(disk, run, sample_orbit_dir, fit_result, tmp_path):
    folder, change = disk
    orbit = (sample_orbit_dir / f"sample_{name}.fits" for name in ("obs", "ref"))
    told_once(run("fit", *orbit, "-o", folder / "r.fits"), folder)
    write_result(fit_result, tmp_path / "r.fits")
    told_once(run("report", tmp_path / "r.fits", "-o", folder / "r.html"), folder)
    assert names(folder) == []
    change("ro")
    code, _, err = run("report", tmp_path / "r.fits", "-o", folder / "r.html")
    assert code == 2
    assert "read-only" in err


@pytest.mark.full
@pytest.mark.slow
def test_compilations_that_a_full_disk_does_not_keep_are_not_reported(disk, tmp_path):
    folder, _ = disk
    # An entry that cannot be written is left cut off, and cannot be read the next time.
    for name in ("one", "two"):
        done = subprocess.run(
            [sys.executable, "-m", "plateviz.cli.main", "simulate", name, "--orbits", "1"],
            cwd=tmp_path,
            env={**os.environ, "JAX_COMPILATION_CACHE_DIR": str(folder)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0
        assert "Error" not in done.stderr


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no such device on this system")
@pytest.mark.parametrize("unbuffered", ["", "1"], ids=["at-the-end", "at-once"])
def test_result_that_is_printed_to_a_full_disk_is_told(sample_orbit_dir, unbuffered):
    command = [sys.executable, "-m", "plateviz.cli.main", "inspect", str(sample_orbit_dir)]
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            command,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
        )
    assert done.returncode == 2
    assert "standard output: expected to write the file, found a full disk" in done.stderr
    assert done.stderr.strip().count("\n") == 0


@pytest.mark.parametrize("unbuffered", ["", "1"], ids=["at-the-end", "at-once"])
def test_reader_that_has_read_enough_is_no_error(sample_orbit_dir, unbuffered):
    command = [sys.executable, "-m", "plateviz.cli.main", "inspect", str(sample_orbit_dir)]
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
        assert process.wait(60) == 1
