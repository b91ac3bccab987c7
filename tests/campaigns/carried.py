"""Records of the verdict carried over to another version of it, of the cases it judges alike."""

import itertools
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.campaigns.trials import Record, mark_records, read_records
from tests.campaigns.verdict_cases import trial_of

_SAME = ("state", "causes", "converged", "failed")
# Significances are recorded with one digit after the point.
_ROUNDING = 0.101


class CarriedOver(NamedTuple):
    """What was carried over.

    Attributes
    ----------
    records : number of records
    different : trials whose verdicts differ, in words, a line each; their cases were left out
    """

    records: int
    different: list[str]


def carry_over(
    path: Path, trial: Callable[[int], Record], before: str, version: str, count: int
) -> CarriedOver:
    """Mark the records of a version with another one where a sample of trials gives the same again.

    A case is a defect with or without its cause in the model, or no defect. The records of a case
    are marked if all trials that are repeated of it have the same verdict.

    Parameters
    ----------
    path : of the records; no campaign may write to it meanwhile
    trial : given its number, returns what is recorded
    before, version : version of the records, and the one that they are carried over to
    count : number of trials that are repeated, or a few more

    Raises
    ------
    ValueError
        If there are no records of the version.
    """
    records = read_records(path, before)
    if not records:
        raise ValueError(f"expected records of version {before} in {path}, found none")
    repeated = {number: trial(number) for number in sample(records, count)}
    different = {
        number: f"{_words(number)}, {number}: recorded {_said(records[number])}, now {_said(found)}"
        for number, found in repeated.items()
        if not is_same(records[number], found)
    }
    changed = {_case_of(number) for number in different}
    same = {number for number in records if _case_of(number) not in changed}
    mark_records(path, before, version, same)
    return CarriedOver(len(same), list(different.values()))


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


def _case_of(number: int) -> tuple[str, bool]:
    """Return the defect of a trial, and whether its cause is modelled."""
    trial = trial_of(number)
    return (trial.case.title if trial.case else "clean", trial.is_modelled)


def _words(number: int) -> str:
    name, is_modelled = _case_of(number)
    return f"{name}{' modelled' if is_modelled else ''}"


def _said(record: Record) -> str:
    return ", ".join(f"{name} {record[name]}" for name in (*_SAME, "sigma") if name in record)
