"""The line of progress in a cell and in a terminal."""

import sys
from types import SimpleNamespace

import pytest

from plateviz.notebook import progress
from plateviz.notebook.progress import CellReporter, notebook_shell, reporting
from plateviz.solving.job import Job


class Shell:
    """A fake notebook shell that records the published lines."""

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


def test_one_line_is_updated_and_stays_with_the_time_taken(shell):
    with reporting("orbit 3") as reporter:
        assert isinstance(reporter, CellReporter)
        reporter.say("iteration 1")
    texts, ids, updates = zip(*shell.lines, strict=True)
    assert texts[0].startswith("orbit 3 (0.")
    assert texts[-1].startswith("orbit 3: done (0.")
    assert len(set(ids)) == 1
    assert updates == (False, *[True] * (len(updates) - 1))


def test_interrupted_work_is_marked_as_stopped(shell):
    with pytest.raises(KeyboardInterrupt), reporting("orbit 3"):
        raise KeyboardInterrupt
    assert shell.lines[-1][0].startswith("orbit 3: stopped (")


def test_updates_of_a_cell_are_limited(shell, monkeypatch):
    with reporting("svi") as reporter:
        for step in range(1000):
            reporter.say(f"step {step}")
    assert len(shell.lines) < 50
    monkeypatch.setattr(progress, "_INTERVAL_S", -1.0)
    with reporting("svi") as reporter:
        reporter.say("step 1")
        reporter.step(1, 4)
    assert shell.lines[-2][0].startswith("step 1, 1 of 4 (")


def test_job_is_followed_to_its_end(shell):
    job = Job({"do": "fit"})
    job.take({"event": "progress", "stage": "simulating", "done": 1, "total": 2})
    job.take({"event": "done"})
    with reporting("simulating") as reporter:
        assert reporter.follow(job).is_over


def test_terminal_has_another_reporter(monkeypatch):
    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    with reporting("orbit 3") as reporter:
        assert not isinstance(reporter, CellReporter)
        reporter.say("iteration 1")
