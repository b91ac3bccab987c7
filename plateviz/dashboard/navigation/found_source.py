"""FoundSource: a source of a run, found by its id."""

import re
from typing import NamedTuple

import pandas as pd

from plateviz.runs.queries import SurveyRun

_ID = re.compile(r"-?[0-9]{1,19}")
_LARGEST_ID = 2**63 - 1


class FoundSource(NamedTuple):
    """One source of a run: a row per orbit and, once the run is complete, its motion."""

    source_id: int
    history: pd.DataFrame
    motion: pd.Series | None


def find_source(run: SurveyRun, text: str) -> tuple[FoundSource | None, str]:
    """Return a source of a run, or a message on why there is none."""
    if not _ID.fullmatch(text) or abs(int(text)) > _LARGEST_ID:
        return None, f"Expected the id of a source, a whole number, found {text[:40]!r}."
    source_id = int(text)
    history = run.history(source_id)
    if history.empty:
        return None, f"Run {run.name!r} has no source {source_id}."
    return FoundSource(source_id, history, run.motion(source_id)), ""
