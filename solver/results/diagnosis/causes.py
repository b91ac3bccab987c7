"""The causes that explain the tests of a solution, the most likely first.

Patterns overlap: a drift of the distortion is also a map, a motion of detectors, a change of each
exposure. So the pattern that explains most is taken first, and the others are tested again as if
it were fitted, too, until nothing that is left is more than chance. What a cause explains of chi2
is not noise.
"""

from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from solver.results.diagnosis.projection import Projection
from solver.results.diagnosis.rate import sigmas
from solver.results.diagnosis.scatter import Scatter, scatter_tests
from solver.results.diagnosis.table import CARE_RATE, Diagnosis, Test, pattern_test

# What each parameter of a pattern has to explain: the simpler of two explanations is taken.
_PER_PARAMETER = 4.0
_MOST_PATTERNS = 4
# A pattern after the first one is named if it explains this share of what the first one does.
_LEAST_SHARE = 0.1
# Patterns that name no cause: they are taken only where no other explains as much.
_WITHOUT_CAUSE = ("cells", "map")
# Those whose tests follow one another.
_PATTERNS = (
    "drift",
    "bend",
    "step",
    "velocity",
    "order",
    "shift",
    "turn",
    "phase",
    "magnitude",
    *_WITHOUT_CAUSE,
)
# The positions of the sources carry these into all exposures.
_MAKES_PATTERNS = ("swing", "outliers", "stretch", "shear", "quadratic", "references", "reference")
# A cause of another kind is named beside the first one from this share of its sigmas.
_OF_ITS_OWN = 0.5
_REFERENCE_LIMIT = 0.01
# Median of a chi2 with two degrees of freedom.
_MEDIAN_CHI2 = 1.3863


class Found(NamedTuple):
    """A cause that the tests point to.

    Attributes
    ----------
    test : the test that says so, after the causes before it
    items : indices of exposures, or ids of sources, that it is about; may be empty
    size : rms displacement, um, or another amplitude of the cause
    """

    test: Test
    items: tuple[int, ...] = ()
    size: float = float("nan")


class Causes(NamedTuple):
    """The causes of a solution's flaws.

    Attributes
    ----------
    found : the causes, the most likely first
    left : chi2 per degree of freedom without what the patterns explain, as a test
    """

    found: tuple[Found, ...]
    left: Scatter


def find_causes(diagnosis: Diagnosis) -> Causes:
    """Return the causes that explain the tests of a solution."""
    patterns, explained = _patterns(diagnosis)
    scatter = scatter_tests(
        diagnosis.rows, diagnosis.magnitude, explained, without=diagnosis.swinging
    )
    found = [*_swinging(diagnosis), *patterns, *_of_exposures(diagnosis, patterns)]
    found += _of_scatter(diagnosis, scatter, found)
    found += _of_references(diagnosis)
    found.sort(key=lambda one: one.test.log_chance)
    return Causes(tuple(_of_their_own(found)), scatter[0])


def _of_their_own(found: list[Found]) -> list[Found]:
    """Return the causes without those that the first one may have brought about.

    Patterns were tested one after the other. Of two kinds of causes the weaker may be a result of
    the stronger; the next fit finds it if it is not.
    """
    first = found[:1]
    if not first:
        return []
    leads = first[0].test
    return first + [
        one
        for one in found[1:]
        if one.test.sigma > _OF_ITS_OWN * leads.sigma
        and not (one.test.subject in _PATTERNS and leads.subject in _MAKES_PATTERNS)
        or (one.test.subject in _PATTERNS and leads.subject in _PATTERNS)
    ]


def _limit(diagnosis: Diagnosis) -> float:
    """Return the logarithm of the chance below which a single test is named as a cause."""
    return float(np.log(CARE_RATE / len(diagnosis.tests)))


def _patterns(diagnosis: Diagnosis) -> tuple[list[Found], float]:
    """Return the patterns that the residuals have, and how much of chi2 they explain."""
    projection: Projection = diagnosis.projection
    found: list[Found] = []
    explained, limit = 0.0, _limit(diagnosis)
    while len(found) < _MOST_PATTERNS:
        tests = [
            (family, pattern_test(projection, family, diagnosis.scale))
            for family in diagnosis.patterns.families
        ]
        tests = [one for one in tests if one[1].log_chance < limit]
        named = [one for one in tests if one[1].subject not in _WITHOUT_CAUSE]
        if not (named or tests) or (found and not named):
            break
        family, test = max(named or tests, key=lambda one: _gain(one[1]))
        gain = diagnosis.scale * test.statistic
        if found and gain < _LEAST_SHARE * explained:
            break
        found.append(Found(test, size=test.size_um))
        explained += gain - test.expected
        projection = projection.without(family)
    return found, explained


def _gain(test: Test) -> float:
    return test.statistic - _PER_PARAMETER * test.expected


def _swinging(diagnosis: Diagnosis) -> list[Found]:
    test = next(one for one in diagnosis.tests if one.subject == "swing")
    if not len(diagnosis.swinging):
        return []
    return [Found(test, tuple(int(one) for one in diagnosis.swinging))]


def _of_exposures(diagnosis: Diagnosis, patterns: list[Found]) -> list[Found]:
    """Return the cause that each exposure has a pattern of its own, the one that explains most."""
    subjects = ("stretch", "shear", "quadratic")
    tests = [one for one in diagnosis.tests if one.subject in subjects]
    best = max(tests, key=_excess)
    explained = max((one.test.statistic for one in patterns), default=0.0)
    if best.log_chance > _limit(diagnosis) or _excess(best) < explained:
        return []
    return [Found(best)]


def _excess(test: Test) -> float:
    return test.statistic - test.expected


def _of_scatter(diagnosis: Diagnosis, scatter: list[Scatter], found: list[Found]) -> list[Found]:
    """Return the causes that change the size of the residuals."""
    limit = _limit(diagnosis)
    by_name = {one.name: one for one in scatter}
    tests = {one.subject: one for one in diagnosis.tests}
    strongest = max((one.test.sigma for one in found), default=0.0)
    causes = []
    if by_name["outliers"].log_chance < limit:
        causes.append(Found(tests["outliers"], size=by_name["outliers"].value))
    groups = [tests[name] for name in ("exposures", "magnitudes", "detectors") if name in tests]
    # Another cause also changes these, but by less than it shows itself.
    groups = [one for one in groups if one.log_chance < limit and one.sigma > strongest]
    if groups:
        # One whose noise differs most; it also changes chi2 as a whole.
        test, noise = min(groups, key=lambda one: one.log_chance), tests["noise"]
        return [*causes, Found(test._replace(log_chance=min(test.log_chance, noise.log_chance)))]
    noise, strongest = by_name["noise"], min((one.test.log_chance for one in found), default=0.0)
    if noise.log_chance < min(limit, strongest):
        sigma = sigmas(noise.log_chance)
        test = tests["noise"]._replace(
            statistic=noise.value, log_chance=noise.log_chance, sigma=sigma
        )
        causes.append(Found(test, size=float(np.sqrt(noise.value) - 1.0)))
    sources = tests["sources"]
    if sources.log_chance < limit and not (causes or found):
        causes.append(Found(sources))
    return causes


def _of_references(diagnosis: Diagnosis) -> list[Found]:
    """Return whether some, or all, of the reference stars are wrong."""
    ids, chi2 = diagnosis.references
    if not len(chi2):
        return []
    limit = _limit(diagnosis)
    tests = [one for one in diagnosis.tests if one.subject in ("references", "reference")]
    worst = min(tests, key=lambda one: one.log_chance)
    if worst.log_chance > limit:
        return []
    # Wrong stars pull the frame, and so all others; only those that are far beyond are wrong.
    typical = max(float(np.median(chi2)) / _MEDIAN_CHI2, 1.0)
    far = chi2 / typical > chdtri(2.0, -np.expm1(np.log1p(-_REFERENCE_LIMIT) / len(chi2)))
    if not far.any():
        return [Found(worst._replace(subject="references"), size=float(np.sqrt(typical)))]
    order = np.argsort(-chi2[far])
    named = tuple(int(one) for one in ids[far][order])
    return [Found(worst._replace(subject="reference"), named, float(far.sum()))]
