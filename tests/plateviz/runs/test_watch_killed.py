"""A watch that is killed while it works: the next one goes on, and the run is as if undisturbed."""

import os
import signal
import subprocess
import sys
import time

import pytest

from plateviz.runs.fit_survey import fit_survey
from plateviz.runs.run_directory import RunDirectory
from solver.data.settings import FitSettings
from solver.io.scratch import is_scratch
from tests.solver.growing_survey import GrowingSurvey

pytestmark = [
    pytest.mark.slow,
    pytest.mark.full,
    pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals"),
]

# What is there while an orbit is written, while the tables of the first one are, and after that.
MOMENTS = (".orbit=*.part", ".*history*.part", "gathered.json")


def watch(directory, *options):
    command = [sys.executable, "-m", "plateviz.cli.main", "watch", str(directory)]
    return subprocess.Popen(
        [*command, "--workers", "1", "--interval", "0.2", "--accept", *options],
        stdout=subprocess.DEVNULL,
        start_new_session=True,
    )


@pytest.mark.parametrize("moment", MOMENTS)
def test_killed_watch_is_gone_on_with(made_survey, tmp_path, moment):
    growing = GrowingSurvey(made_survey, tmp_path / "survey", 1)
    run = RunDirectory(growing.directory, "watched")
    process = watch(growing.directory)
    end = time.monotonic() + 300.0
    while not list(run.directory.glob(moment)):
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.0005)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert not run.is_complete
    for orbit in (1, 2):
        growing.append(orbit)
    assert watch(growing.directory, "--until", "3").wait(300) == 0
    assert run.is_complete
    assert run.changes() == []
    whole = fit_survey(growing.directory, "whole", FitSettings(), workers=1).run
    for name in ("history.parquet", "motions.parquet", "orbit=0000/sources.parquet"):
        assert (run.directory / name).read_bytes() == (whole.directory / name).read_bytes()
    assert not [path for path in growing.directory.rglob("*") if is_scratch(path.name)]
