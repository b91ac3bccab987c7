"""Where the time of an action in the browser goes, from what `timed_server.py` has noted."""

import json
import statistics
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from tests.benchmarks.machine import write


class Stage(NamedTuple):
    """A stage of the server's work; milliseconds since 1970."""

    name: str
    begin: float
    end: float


def report_stages(
    file: Path,
    taken: Iterable[tuple[float, float]],
    messages: Sequence[Mapping[str, float]],
) -> None:
    """Print the median time of each part of some actions, and what was sent to the page.

    Parameters
    ----------
    file : lines of `timed_server.py`
    taken : begin and end of each action, milliseconds since 1970
    messages : to the page, each with its time `at`, its `bytes` and its number of `events`
    """
    stages = [Stage(*json.loads(line)) for line in file.read_text(encoding="utf-8").splitlines()]
    parts = [_parts(begin, end, stages, messages) for begin, end in taken]
    for name in dict.fromkeys(name for one in parts for name in one):
        values = [one[name] for one in parts if name in one]
        write(f"    {name:<46}{statistics.median(values):9,.0f}")


def _parts(
    begin: float, end: float, stages: Iterable[Stage], messages: Iterable[Mapping[str, float]]
) -> dict[str, float]:
    """Return what happened between two moments: marks since the begin, durations, numbers."""
    within = [stage for stage in stages if begin <= stage.begin <= end]
    of_page = [one for one in messages if begin <= one["at"] <= end]
    found: dict[str, float] = {}
    for name in dict.fromkeys(stage.name for stage in within):
        of_name = [stage for stage in within if stage.name == name]
        found[f"at (ms): {name}"] = of_name[0].begin - begin
        if (spent := sum(stage.end - stage.begin for stage in of_name)) >= 1.0:
            found[f"spent (ms): {name}"] = spent
    if within:
        found["at (ms): end of the server's work"] = max(stage.end for stage in within) - begin
    if of_page:
        found["at (ms): last message"] = of_page[-1]["at"] - begin
    found["at (ms): drawn"] = end - begin
    found["changes sent"] = sum(one["events"] for one in of_page)
    found["messages"] = sum(one["events"] > 0 for one in of_page)
    found["kB sent"] = sum(one["bytes"] for one in of_page) / 1000.0
    return found
