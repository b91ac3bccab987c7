"""A line of progress in a cell, and in a terminal."""

import sys
from types import SimpleNamespace

import pytest

from plateviz.notebook import progress
from plateviz.notebook.progress import CellReporter, notebook_shell, reporting
from plateviz.solving.job import Job


class Shell:
    """As much of a notebook's shell as is asked for; keeps what is published."""

    def __init__(self):
        self.kernel = object()
        self.display_pub = SimpleNamespace(publish=self.publish)
        self.lines = []

    def publish(self, data, *, transient, update):
        self.lines.append((data["text/plain"], transient["display_id"], update))


@pytest.fixture
def shell(monkeypatch):
    made = Shell()
    ipython = SimpleNamespace(get_ipython=lambda: made)
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    return made


def test_there_is_no_shell_outside_a_notebook(monkeypatch):
    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    assert notebook_shell() is None
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: None))
    assert notebook_shell() is None


def test_one_line_is_written_over_and_stays_with_its_time(shell):
    with reporting("orbit 3") as reporter:
        assert isinstance(reporter, CellReporter)
        reporter.say("iteration 1")
    words, names, updates = zip(*shell.lines, strict=True)
    assert words[0].startswith("orbit 3 (0.")
    assert words[-1].startswith("orbit 3: done (0.")
    assert len(set(names)) == 1
    assert updates == (False, *[True] * (len(updates) - 1))


def test_what_was_stopped_says_so(shell):
    with pytest.raises(KeyboardInterrupt), reporting("orbit 3"):
        raise KeyboardInterrupt
    assert shell.lines[-1][0].startswith("orbit 3: stopped (")


def test_a_cell_is_not_written_with_every_report(shell, monkeypatch):
    with reporting("svi") as reporter:
        for step in range(1000):
            reporter.say(f"step {step}")
    assert len(shell.lines) < 50
    monkeypatch.setattr(progress, "_PAUSE_S", -1.0)
    with reporting("svi") as reporter:
        reporter.say("step 1")
        reporter.step(1, 4)
    assert shell.lines[-2][0].startswith("step 1, 1 of 4 (")


def test_a_job_is_followed_to_its_end(shell):
    job = Job({"do": "fit"})
    job.take({"event": "progress", "stage": "simulating", "done": 1, "total": 2})
    job.take({"event": "done"})
    with reporting("simulating") as reporter:
        assert reporter.follow(job).is_over


def test_a_terminal_has_a_line_of_its_own(monkeypatch):
    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    with reporting("orbit 3") as reporter:
        assert not isinstance(reporter, CellReporter)
        reporter.say("iteration 1")
