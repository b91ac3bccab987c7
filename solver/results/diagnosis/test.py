"""One test of a solution, and which of many are discoveries."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from solver.results.diagnosis.rate import discoveries


class Test(NamedTuple):
    """One test of a solution.

    Attributes
    ----------
    name : of the test
    subject : what it is about, the key of its meaning
    what : degree, step, detector, axis, or place of the group in `solver.data.parameters`
    statistic, expected, scatter : value, and what a good solution has
    log_chance : logarithm of the probability of a value as far by chance
    sigma : the same as the distance of a normal value
    size_um : rms displacement of the pattern, um; NaN if the test is not about one
    """

    # pytest collects classes with this name otherwise.
    __test__ = False

    name: str
    subject: str
    what: tuple[int, ...]
    statistic: float
    expected: float
    scatter: float
    log_chance: float
    sigma: float
    size_um: float = float("nan")


def discovered(tests: Sequence[Test], rate: float) -> tuple[Test, ...]:
    """Return the tests that are discoveries at a rate of false alarms over all of them."""
    far = discoveries(np.array([test.log_chance for test in tests]), rate)
    return tuple(test for test, is_far in zip(tests, far, strict=True) if is_far)
