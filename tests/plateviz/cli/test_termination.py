"""SIGTERM or Ctrl-C to a command: exit code, no traceback, no scratch folder, no process left."""

import os
import signal
import subprocess
import sys
import time

import pytest

from solver.io.scratch import is_scratch

pytestmark = [
    pytest.mark.slow,
    pytest.mark.full,
    pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals"),
]


@pytest.mark.parametrize("to", ["process", "group"])
@pytest.mark.parametrize(
    ("arguments", "begun"),
    [
        (("simulate", "new", "--orbits", "50"), "new/measurements/orbit=*"),
        (("survey", "survey", "--workers", "2"), "survey/runs/default/.orbit*.part"),
        (("serve", "survey", "--no-open", "--port", "0"), "tmp/plateviz-*.part"),
    ],
    ids=["simulate", "survey", "serve"],
)
def test_sigterm_ends_a_command_cleanly(survey_folder, tmp_path, arguments, begun, to):
    assert survey_folder.parent == tmp_path
    process = started(tmp_path, arguments, begun)
    os.kill(process.pid if to == "process" else -process.pid, signal.SIGTERM)
    assert process.wait(60) == 143
    require_nothing_left(tmp_path)


@pytest.mark.parametrize(("command", "code"), [("survey", 130), ("watch", 0)])
@pytest.mark.parametrize("seconds", [0.0, 0.7], ids=["scheduler", "workers"])
def test_interrupt_while_workers_start_ends_a_command_quietly(
    survey_folder, tmp_path, command, code, seconds
):
    assert survey_folder.parent == tmp_path
    begun = "tmp/plateviz-workers-*.part/dask-scratch-space/*"
    process = started(tmp_path, (command, "survey", "--workers", "2"), begun)
    time.sleep(seconds)
    # As a terminal does.
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(60) == code
    assert "ERROR" not in (tmp_path / "printed").read_text()
    require_nothing_left(tmp_path)


def started(tmp_path, arguments, begun):
    """Start a command in a folder, and return it once a file says that it has begun."""
    (tmp_path / "tmp").mkdir()
    with (tmp_path / "printed").open("wb") as printed:
        process = subprocess.Popen(
            [sys.executable, "-m", "plateviz.cli.main", *arguments],
            cwd=tmp_path,
            env={**os.environ, "TMPDIR": str(tmp_path / "tmp")},
            stdout=printed,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    end = time.monotonic() + 120.0
    while not list(tmp_path.glob(begun)):
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.005)
    return process


def require_nothing_left(tmp_path):
    end = time.monotonic() + 60.0
    text = (tmp_path / "printed").read_text()
    assert "Traceback" not in text
    assert not [path for path in tmp_path.rglob("*") if is_scratch(path.name)]
    while list_of_processes(tmp_path):
        assert time.monotonic() < end
        time.sleep(0.05)


def list_of_processes(folder):
    """Return the processes that run in a folder."""
    listed = subprocess.run(["ps", "-eo", "pid="], capture_output=True, text=True, check=True)
    return [pid for pid in listed.stdout.split() if folder_of(pid) == str(folder)]


def folder_of(pid):
    try:
        return os.readlink(f"/proc/{pid}/cwd")
    except OSError:
        return ""
