"""FoundSource: a source of a run, found by its id."""

import re
from typing import NamedTuple

import pandas as pd

from plateviz.runs.run import Run
from solver.data.ids import ID, is_id


class FoundSource(NamedTuple):
    """One source of a run: a row per orbit and, once the run is complete, its motion."""

    source_id: int
    history: pd.DataFrame
    motion: pd.Series | None


def find_source(run: Run, text: str) -> tuple[FoundSource | None, str]:
    """Return a source of a run, or a message on why there is none."""
    if not re.fullmatch(ID, text) or not is_id(int(text)):
        return None, f"Expected the id of a source, a whole number, found {text[:40]!r}."
    source_id = int(text)
    history = run.history(source_id)
    if history.empty:
        return None, f"Run {run.name!r} has no source {source_id}."
    return FoundSource(source_id, history, run.motion(source_id)), ""
