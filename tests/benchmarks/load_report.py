"""The table of `bench_load.py`."""

import statistics
from collections import Counter
from collections.abc import Sequence

from tests.benchmarks.machine import write

_MOST_LINES = 10


def report_heading() -> None:
    names = f"{'median':>9}{'95 %':>9}{'maximum':>9}{'n':>7}"
    write(f"{'what (s; memory in MB)':<54}{'asked':>10}{names}")


def report_seconds(what: str, seconds: Sequence[float], asked: str) -> None:
    """Print a row about durations."""
    if not seconds:
        write(f"{what:<54}{asked:>10}{'none':>9}")
        return
    ordered = sorted(seconds)
    high = ordered[min(len(ordered) - 1, round(0.95 * len(ordered)))]
    median = statistics.median(ordered)
    write(f"{what:<54}{asked:>10}{median:9.2f}{high:9.2f}{ordered[-1]:9.2f}{len(ordered):7}")


def report_memory(what: str, megabytes: float, asked: str) -> None:
    """Print a row about memory."""
    write(f"{what:<54}{asked:>10}{'':18}{megabytes:9.1f}")


def report_errors(errors: Sequence[str], said: str) -> None:
    """Print a row about errors: those that the pages noted, and the tracebacks of the server."""
    found = f"{len(errors)}; {said.count('Traceback')}"
    write(f"{'    errors; tracebacks of the server':<54}{'0; 0':>10}{'':18}{found:>9}")
    for text, many in Counter(errors).most_common(_MOST_LINES):
        write(f"    {many} x {' '.join(text.split())[:200]}")
    for line in said.splitlines()[-_MOST_LINES:]:
        write(f"    server: {line[:200]}")
