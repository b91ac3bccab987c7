"""The patterns that the residuals have: the likeliest first, the others as if it were fitted."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from solver.results.diagnosis import gains
from solver.results.diagnosis.courses import COURSES, Courses, are_alternatives
from solver.results.diagnosis.found import CLOSE, Found, limit_of
from solver.results.diagnosis.patterns import Family
from solver.results.diagnosis.projection import Projection
from solver.results.diagnosis.table import Diagnosis, pattern_test
from solver.results.diagnosis.test import Test

# A pattern after the first one is named if it explains this share of what the first one does.
LEAST_SHARE = 0.1
# Patterns that name no cause: one is taken first, and only if it explains so much more than any
# other.
_WITHOUT_CAUSE, _MUCH_MORE = ("cells", "map"), 4.0
# Those whose tests follow one another.
PATTERNS = (*COURSES, "order", "shift", "turn", "phase", "magnitude", *_WITHOUT_CAUSE)
_MOST_PATTERNS = 4


class PatternCauses(NamedTuple):
    """The patterns that the residuals have.

    Attributes
    ----------
    found : the patterns, the most likely first, each after those before it
    rivals : patterns that explain the residuals nearly as well as the first, in place of it
    explained : what those that are found would take from chi2, beyond chance
    """

    found: list[Found]
    rivals: list[Found]
    explained: float


class _Candidate(NamedTuple):
    """A family of patterns that the residuals may have.

    Attributes
    ----------
    gain : how much more likely it makes the residuals
    family, test : the patterns, and their test after those that are taken
    fall : of chi2 with these patterns, by the stated uncertainties
    """

    gain: float
    family: Family
    test: Test
    fall: float

    def as_found(self) -> Found:
        return Found(self.test, self.gain, size=self.test.size_um)


class _Course(NamedTuple):
    """A candidate among those of the same terms, and its gain with all exposures."""

    gain: float
    candidate: _Candidate


def pattern_causes(diagnosis: Diagnosis) -> PatternCauses:
    """Return the patterns that the residuals of a solution have."""
    projection, families = diagnosis.projection, diagnosis.patterns.families
    comparison, explained = Courses(diagnosis), 0.0
    taken, rivals = list[_Candidate](), list[_Candidate]()
    while len(taken) < _MOST_PATTERNS:
        least = LEAST_SHARE * explained if taken else -np.inf
        candidates = _candidates(diagnosis, projection, families)
        alike = _likeliest(candidates)
        # Before they are compared, which takes as long as all tests.
        if not any(one.fall >= least for one in alike):
            break
        courses = _compared(comparison, alike, taken)
        best = max(courses, key=lambda one: one.gain)
        first = best.candidate
        if first.fall < least:
            break
        if not taken:
            rivals = _rivals(candidates, courses, best)
        taken.append(first)
        explained += first.fall - first.test.expected
        projection = projection.without(first.family)
        families = _families_after(families, first.family)
    others = [one for one in rivals if not any(one.family is each.family for each in taken)]
    return PatternCauses(
        [one.as_found() for one in taken], [one.as_found() for one in others], explained
    )


def _candidates(
    diagnosis: Diagnosis, projection: Projection, families: Sequence[Family]
) -> list[_Candidate]:
    """Return the families whose patterns are more than chance, in their order.

    Parameters
    ----------
    projection : of the residuals, with the patterns that are taken as if they were fitted
    families : those that are not taken
    """
    scale, limit = diagnosis.scale, limit_of(diagnosis)
    found = []
    for family in families:
        test = pattern_test(projection, family, scale)
        if test.log_chance < limit:
            gain = gains.of_pattern(projection, family, test, scale)
            found.append(_Candidate(gain, family, test, scale * test.statistic))
    return found


def _likeliest(candidates: list[_Candidate]) -> list[_Candidate]:
    """Return the likeliest candidate, with all other courses in time of its terms."""
    if not candidates:
        return []
    first = max(candidates, key=_rank).family
    return [one for one in candidates if are_alternatives(one.family, first)]


def _rank(candidate: _Candidate) -> tuple[bool, float]:
    """Return what patterns are ordered by: the gain, less for one that names no cause."""
    gain = candidate.gain
    if candidate.family.subject in _WITHOUT_CAUSE:
        return gain > 0.0, gain / _MUCH_MORE
    return True, gain


def _compared(
    comparison: Courses, alike: list[_Candidate], taken: list[_Candidate]
) -> list[_Course]:
    """Return courses in time of the same terms with their gains with all exposures."""
    found = comparison.gains([one.family for one in alike], [one.family for one in taken])
    return [_Course(gain, one) for gain, one in zip(found, alike, strict=True)]


def _families_after(families: Sequence[Family], taken: Family) -> list[Family]:
    """Return the families that are tried after one is taken: those that name another cause."""
    return [
        one
        for one in families
        if one.subject not in _WITHOUT_CAUSE and not are_alternatives(one, taken)
    ]


def _rivals(
    candidates: list[_Candidate], courses: list[_Course], best: _Course
) -> list[_Candidate]:
    """Return the patterns that are nearly as likely as the best one, the likeliest first.

    Parameters
    ----------
    courses : in time of the terms of the best one, which is one of them
    """
    first = best.candidate
    behind = [(best.gain - gain, one) for gain, one in courses]
    behind += [
        (first.gain - one.gain, one)
        for one in candidates
        if one.family.subject not in _WITHOUT_CAUSE
        and not are_alternatives(one.family, first.family)
    ]
    near = [one for one in behind if one[0] < CLOSE and one[1] is not first]
    return [one for _, one in sorted(near, key=lambda one: one[0])]
