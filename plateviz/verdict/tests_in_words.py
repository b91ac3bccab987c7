"""The tests of a solution as a table in words."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from solver.results.diagnosis.rate import discoveries
from solver.results.diagnosis.table import CARE_RATE, Diagnosis
from solver.results.diagnosis.test import Test
from solver.units import NM_PER_UM

_MOST_NAMED = 3
_DEGREES = ("drift", "bend", "step")
_DETECTORS = ("shift", "turn", "cells")
_AXES = ("phase", "magnitude")
_ENDINGS = {1: "st", 2: "nd", 3: "rd"}


class TestInWords(NamedTuple):
    """One test of a solution.

    Attributes
    ----------
    name : what is tested
    statistic, expected, scatter : its value, and mean and scatter of good solutions
    sigma : its chance as the distance of a normal value
    size_nm : rms displacement of its pattern on the focal plane, nm; None if it has none
    is_found : whether it is a discovery, at the rate of false alarms of the verdict
    """

    # pytest collects classes with this name otherwise.
    __test__ = False

    name: str
    statistic: float
    expected: float
    scatter: float
    sigma: float
    size_nm: float | None
    is_found: bool


def tests_in_words(diagnosis: Diagnosis) -> list[TestInWords]:
    """Return the tests of a solution, in the order in which they were made."""
    chances = np.array([test.log_chance for test in diagnosis.tests])
    return [
        TestInWords(
            f"{test.name}{_about(test)}",
            float(test.statistic),
            float(test.expected),
            float(test.scatter),
            float(test.sigma),
            NM_PER_UM * float(test.size_um) if np.isfinite(test.size_um) else None,
            bool(is_found),
        )
        for test, is_found in zip(diagnosis.tests, discoveries(chances, CARE_RATE), strict=True)
    ]


def discoveries_in_words(
    all_tests: Sequence[Test],
    found: Sequence[Test],
    *,
    tests: str = "tests",
    good: str = "good solutions",
) -> str:
    """Return a sentence on how many of the tests are discoveries, and which.

    Parameters
    ----------
    tests, good : words for the tests, and for what has no flaw
    """
    total = len(all_tests)
    chance = f"in {100 * CARE_RATE:.0f} % of {good} any of them would"
    if not found:
        return f"None of {total} {tests} finds anything that chance does not explain; {chance}."
    named = ", ".join(dict.fromkeys(one.name for one in found[:_MOST_NAMED]))
    find = "finds" if len(found) == 1 else "find"
    return (
        f"{len(found)} of {total} {tests} {find} what chance does not explain, "
        f"among them: {named}; {chance}."
    )


def _about(test: Test) -> str:
    """Return the degree, the step, the detector or the axis of a test."""
    if test.subject in _DEGREES:
        degree, *steps = test.what
        return f", degree {degree}" + "".join(f", change {one + 1}" for one in steps)
    if test.subject in _DETECTORS:
        # A test knows the place of a detector, not its id, which may begin with 0.
        return f", {_ordinal(test.what[0] + 1)} detector of the instrument"
    if test.subject in _AXES:
        return f", {'xy'[test.what[0]]}"
    if test.subject == "references":
        return f", {'αδ'[test.what[0]]}"
    return ""


def _ordinal(number: int) -> str:
    """Return 1st, 2nd, 3rd, 4th, ..., 11th, ..., 21st, ..."""
    ending = "th" if number % 100 in (11, 12, 13) else _ENDINGS.get(number % 10, "th")
    return f"{number}{ending}"
