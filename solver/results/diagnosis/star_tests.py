"""Tests of the stars against the catalogue: their positions, and the epoch of these."""

import numpy as np

from solver.data.result import FitResult
from solver.results.diagnosis.epoch import EpochOffset
from solver.results.diagnosis.rate import (
    log_chance_binomial,
    log_chance_normal,
    of_many,
    sigmas,
)
from solver.results.diagnosis.references import MEDIAN_CHI2, CatalogueChi2, deviation_chance
from solver.results.diagnosis.test import Test


def reference_tests(result: FitResult, found: CatalogueChi2) -> list[Test]:
    """Return the tests of the reference stars."""
    tests = []
    for number, axis in enumerate(("ra", "dec")):
        value, expected, scatter, chance = deviation_chance(result, axis)
        numbers = value, expected, scatter, chance, sigmas(chance)
        tests.append(Test("reference stars, all", "references", (number,), *numbers))
    if len(found.chi2):
        tests.append(furthest_test("reference star that is furthest off", "reference", found))
    return tests


def other_star_tests(found: CatalogueChi2) -> list[Test]:
    """Return the tests of the other stars, whose catalogue errors may be no more than bounds."""
    n = len(found.chi2)
    if not n:
        return []
    many = int((found.chi2 > MEDIAN_CHI2).sum())
    chance = log_chance_binomial(many, n, 0.5)
    numbers = many / n, 0.5, float(np.sqrt(0.25 / n)), chance, sigmas(chance)
    return [
        Test("other stars beyond the median of their errors", "others", (), *numbers),
        furthest_test("other star that is furthest off", "other", found),
    ]


def epoch_tests(found: EpochOffset) -> list[Test]:
    """Return the test of a time that is wrong in all exposures alike."""
    if not found.sigma > 0.0:
        return []
    chance = log_chance_normal(found.days / found.sigma)
    numbers = found.days, 0.0, found.sigma, chance, sigmas(chance)
    return [Test("reference stars along their proper motions, days", "epoch", (), *numbers)]


def furthest_test(name: str, subject: str, found: CatalogueChi2) -> Test:
    """Return the test of the star that is furthest from its catalogue position."""
    largest, n = float(found.chi2.max()), len(found.chi2)
    chance = of_many(-0.5 * largest, n)
    numbers = largest, 2.0 * float(np.log(n / np.log(2.0))), 2.6, chance, sigmas(chance)
    return Test(name, subject, (), *numbers)
