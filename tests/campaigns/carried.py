"""Records of the verdict carried over to another version of it that judges alike."""

import itertools
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from tests.campaigns.trials import Record, mark_records, read_records
from tests.campaigns.verdict_cases import trial_of

_SAME = ("state", "causes", "converged", "failed")
# Significances are recorded with one digit after the point.
_ROUNDING = 0.101


def carry_over(
    path: Path, trial: Callable[[int], Record], before: str, version: str, count: int
) -> list[str]:
    """Mark the records of a version with another one, if a sample of trials gives the same again.

    Parameters
    ----------
    path : of the records; no campaign may write to it meanwhile
    trial : given its number, returns what is recorded
    before, version : version of the records, and the one that they are carried over to
    count : number of trials that are repeated, or a few more

    Returns
    -------
    What differs, a line for each trial; if any does, the records are left as they are

    Raises
    ------
    ValueError
        If there are no records of the version.
    """
    records = read_records(path, before)
    if not records:
        raise ValueError(f"expected records of version {before} in {path}, found none")
    repeated = {number: trial(number) for number in sample(records, count)}
    different = [
        f"{number}: recorded {_said(records[number])}, now {_said(found)}"
        for number, found in repeated.items()
        if not is_same(records[number], found)
    ]
    if not different:
        mark_records(path, before, version)
    return different


def sample(numbers: Iterable[int], count: int) -> list[int]:
    """Return at least so many of the trials, spread over the cases and over their amplitudes."""
    groups = [list(group) for _, group in itertools.groupby(sorted(numbers), _case_of)]
    each = -(-count // len(groups))
    places = (np.unique(np.linspace(0, len(group) - 1, each).round()) for group in groups)
    return [group[int(one)] for group, of in zip(groups, places, strict=True) for one in of]


def is_same(record: Record, other: Record) -> bool:
    """Return whether two records of a trial have the same verdict, its sigmas up to rounding."""
    apart = abs(record.get("sigma", 0.0) - other.get("sigma", 0.0))
    return apart < _ROUNDING and all(record.get(name) == other.get(name) for name in _SAME)


def _case_of(number: int) -> str:
    case = trial_of(number).case
    return case.name if case else ""


def _said(record: Record) -> str:
    return ", ".join(f"{name} {record[name]}" for name in (*_SAME, "sigma") if name in record)
