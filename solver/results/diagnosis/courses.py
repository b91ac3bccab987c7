"""Which course in time the distortion took: a drift, an oscillation, steps, or that of a velocity.

Over the part of the orbital period that an orbit observes, an oscillation is nearly straight, so
that two courses differ by a hundredth of what each explains. The covariance from a few exposures of
each field is no better than that: enough to see that the distortion changes, not to say how. So
courses that rival each other are compared with a covariance that has all exposures.
"""

from collections.abc import Sequence
from functools import cached_property

from solver.results.diagnosis import gains
from solver.results.diagnosis.patterns import Family
from solver.results.diagnosis.projection import Projection, covariance_of_products
from solver.results.diagnosis.table import Diagnosis, pattern_test
from solver.runtime.threads import one_blas_thread

# Courses in time of the same terms: of these only the one that explains most is named.
COURSES = ("drift", "bend", "step", "velocity")
_VELOCITY_DEGREE = 2


class Courses:
    """The courses of a solution's distortion, compared with all exposures."""

    def __init__(self, diagnosis: Diagnosis) -> None:
        self._diagnosis = diagnosis

    def gains(self, rivals: Sequence[Family], explained: Sequence[Family]) -> list[float]:
        """Return the gain of each course; that of a single one, which has no rival, is zero.

        Parameters
        ----------
        rivals : courses of the same terms
        explained : patterns that are fitted, too
        """
        if len(rivals) == 1:
            return [0.0]
        projection, scale = self._projection, self._diagnosis.scale
        for family in explained:
            projection = projection.without(family)

        def gain(family: Family) -> float:
            test = pattern_test(projection, family, scale)
            return gains.of_pattern(projection, family, test, scale)

        return [gain(family) for family in rivals]

    @cached_property
    def _projection(self) -> Projection:
        found = self._diagnosis
        with one_blas_thread():
            total, left = covariance_of_products(
                found.result, found.camera, found.rows, found.patterns, all_exposures=True
            )
        return found.projection._replace(total=total, left=left)


def are_alternatives(one: Family, other: Family) -> bool:
    """Return whether two families are courses in time of the same terms, or the same."""
    if one.subject not in COURSES or other.subject not in COURSES:
        return one is other
    degrees = [f.what[0] if f.what else _VELOCITY_DEGREE for f in (one, other)]
    return degrees[0] == degrees[1]
