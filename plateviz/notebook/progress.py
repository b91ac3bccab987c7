"""A line of progress in the cell of a notebook, or in the terminal."""

import sys
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

from plateviz.solving import progress as terminal
from plateviz.solving.progress import Reporter

# Minimum interval between two updates of a cell.
_INTERVAL_S = 0.1


def notebook_shell() -> Any | None:  # noqa: ANN401 of IPython, which need not be there
    """Return the IPython shell if this runs in a notebook, else None."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell if getattr(shell, "kernel", None) is not None else None


class CellReporter(Reporter):
    """A line in the output of a cell that is updated in place."""

    def __init__(self, shell: Any, title: str) -> None:  # noqa: ANN401 of IPython
        """Display the line."""
        self._publish = shell.display_pub.publish
        self._transient = {"display_id": uuid.uuid4().hex}
        self._start = time.monotonic()
        self._text, self._fraction, self._written = title, "", 0.0
        self._write(update=False)

    def step(self, done: int, total: int) -> None:
        """Show `done` of `total`."""
        self._fraction = f", {done} of {total}" if total else ""
        self._write_if_due()

    def say(self, text: str) -> None:
        """Show the current activity."""
        self._text = text
        self._write_if_due()

    def end(self, text: str) -> None:
        """Show the final text and the time taken, even if the last update was just now."""
        self._text, self._fraction = text, ""
        self._write()

    def _write_if_due(self) -> None:
        if time.monotonic() - self._written > _INTERVAL_S:
            self._write()

    def _write(self, update: bool = True) -> None:
        self._written = time.monotonic()
        line = f"{self._text}{self._fraction} ({self._written - self._start:.1f} s)"
        data = {"text/plain": line, "text/html": f"<i>{escape(line)}</i>"}
        self._publish(data, transient=self._transient, update=update)


@contextmanager
def reporting(title: str) -> Iterator[Reporter]:
    """Yield a line of progress; in a cell it stays, with the time taken."""
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
