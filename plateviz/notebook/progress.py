"""A line of progress: in the cell of a notebook, else in the terminal."""

import sys
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

from plateviz.solving import progress as terminal
from plateviz.solving.progress import Reporter

# A cell is not written anew more often than this.
_PAUSE_S = 0.1


def notebook_shell() -> Any | None:  # noqa: ANN401 of IPython, which need not be there
    """Return the shell of the notebook that this runs in, or None."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell if getattr(shell, "kernel", None) is not None else None


class CellReporter(Reporter):
    """A line in the output of a cell that is written over."""

    def __init__(self, shell: Any, title: str) -> None:  # noqa: ANN401 of IPython
        """Write the line."""
        self._publish = shell.display_pub.publish
        self._name = {"display_id": uuid.uuid4().hex}
        self._start = time.monotonic()
        self._words, self._share, self._written = title, "", 0.0
        self._write(update=False)

    def step(self, done: int, total: int) -> None:
        """Say how much is done."""
        self._share = f", {done} of {total}" if total else ""
        self._write_at_leisure()

    def say(self, words: str) -> None:
        """Say what is being done."""
        self._words = words
        self._write_at_leisure()

    def end(self, words: str) -> None:
        """Leave words in the cell, and how long it took."""
        self._words, self._share = words, ""
        self._write()

    def _write_at_leisure(self) -> None:
        if time.monotonic() - self._written > _PAUSE_S:
            self._write()

    def _write(self, update: bool = True) -> None:
        self._written = time.monotonic()
        words = f"{self._words}{self._share} ({self._written - self._start:.1f} s)"
        data = {"text/plain": words, "text/html": f"<i>{escape(words)}</i>"}
        self._publish(data, transient=self._name, update=update)


@contextmanager
def reporting(title: str) -> Iterator[Reporter]:
    """Give a line of progress; a cell keeps it with the time that it took."""
    shell = notebook_shell()
    if shell is None:
        with terminal.reporting(title) as reporter:
            yield reporter
        return
    reporter = CellReporter(shell, title)
    ending = "stopped"
    try:
        yield reporter
        ending = "done"
    finally:
        reporter.end(f"{title}: {ending}")
