"""The patterns that the residuals have: the likeliest first, the others as if it were fitted."""

from typing import NamedTuple

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
    gain: float
    family: Family
    test: Test

    def as_found(self) -> Found:
        return Found(self.test, self.gain, size=self.test.size_um)


def pattern_causes(diagnosis: Diagnosis) -> PatternCauses:
    """Return the patterns that the residuals of a solution have."""
    projection: Projection = diagnosis.projection
    families, scale = list(diagnosis.patterns.families), diagnosis.scale
    courses, taken, found = Courses(diagnosis), list[Family](), list[Found]()
    rivals, explained, limit = list[_Candidate](), 0.0, limit_of(diagnosis)
    while len(found) < _MOST_PATTERNS:
        tests = [(family, pattern_test(projection, family, scale)) for family in families]
        tests = [one for one in tests if one[1].log_chance < limit]
        named = [one for one in tests if one[1].subject not in _WITHOUT_CAUSE]
        tried = named if found else tests
        if not tried:
            break
        candidates = [_Candidate(gains.of_pattern(projection, *one, scale), *one) for one in tried]
        first = max(candidates, key=_rank).family
        alike = [one for one in candidates if are_alternatives(one.family, first)]
        falls = [scale * one.test.statistic for one in alike]
        # Before they are compared, which takes as long as all tests.
        if found and max(falls) < LEAST_SHARE * explained:
            break
        of_alike = courses.gains([one.family for one in alike], taken)
        number = of_alike.index(max(of_alike))
        best, fall = alike[number], falls[number]
        if found and fall < LEAST_SHARE * explained:
            break
        if not found:
            rivals = _rivals(candidates, alike, of_alike, best)
        found.append(best.as_found())
        explained += fall - best.test.expected
        projection = projection.without(best.family)
        taken.append(best.family)
        families = [one for one in families if not are_alternatives(one, best.family)]
    others = [one for one in rivals if not any(one.family is each for each in taken)]
    return PatternCauses(found, [one.as_found() for one in others], explained)


def _rank(candidate: _Candidate) -> tuple[bool, float]:
    """Return what patterns are ordered by: the gain, less for one that names no cause."""
    gain, _, test = candidate
    if test.subject in _WITHOUT_CAUSE:
        return gain > 0.0, gain / _MUCH_MORE
    return True, gain


def _rivals(
    candidates: list[_Candidate], alike: list[_Candidate], of_alike: list[float], best: _Candidate
) -> list[_Candidate]:
    """Return the patterns that are nearly as likely as the best one, the likeliest first.

    Parameters
    ----------
    alike, of_alike : courses in time of the same terms, and their gains with all exposures
    """
    behind = [(max(of_alike) - gain, one) for gain, one in zip(of_alike, alike, strict=True)]
    behind += [
        (best.gain - one.gain, one)
        for one in candidates
        if one.test.subject not in _WITHOUT_CAUSE and not are_alternatives(one.family, best.family)
    ]
    near = [one for one in behind if one[0] < CLOSE and one[1] is not best]
    return [one for _, one in sorted(near, key=lambda one: one[0])]
