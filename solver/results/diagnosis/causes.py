"""The causes that explain the tests of a solution, the most likely first.

Patterns overlap: a drift of the distortion is also a map, a motion of detectors, a change of each
exposure. So the pattern that explains most is taken first, and the others are tested again as if
it were fitted, too, until nothing that is left is more than chance. What a cause explains of chi2
is not noise.
"""

from typing import NamedTuple

import numpy as np

from solver.results.diagnosis import gains
from solver.results.diagnosis.contradictions import (
    STARS,
    of_epoch,
    of_others,
    of_priors,
    of_references,
)
from solver.results.diagnosis.found import Found, limit_of
from solver.results.diagnosis.named_causes import FAR_OFF, OF_EXPOSURES, named_causes
from solver.results.diagnosis.pattern_causes import pattern_causes
from solver.results.diagnosis.scatter import Scatter, scatter_tests
from solver.results.diagnosis.scatter_causes import SCATTER, of_scatter
from solver.results.diagnosis.table import Diagnosis

_MOST_RIVALS = 2
# Outliers are wrong identifications if these have this share of their chi2.
_OF_OUTLIERS = 0.5
# Patterns that explain more of chi2 are not linear: what they leave tells nothing about the noise.
_MOST_LINEAR = 0.5
# Those that explain more leave residuals that look like noise: larger in some groups, with tails.
_MOST_BESIDE_NOISE = 0.1


class FoundCauses(NamedTuple):
    """The causes of a solution's flaws.

    Attributes
    ----------
    found : the causes, the most likely first
    rivals : causes that explain the tests nearly as well as the first one, in place of it
    left : chi2 per degree of freedom without what the patterns explain, as a test; None where
        they are so large that it is not known
    """

    found: tuple[Found, ...]
    rivals: tuple[Found, ...]
    left: Scatter | None


def find_causes(diagnosis: Diagnosis) -> FoundCauses:
    """Return the causes that explain the tests of a solution."""
    patterns, rivals, explained = pattern_causes(diagnosis)
    of_exposures, of_each = _of_exposures(diagnosis, explained)
    found = [*_swinging(diagnosis), *patterns, *of_exposures]
    found += [*_of_outliers(diagnosis), *of_priors(diagnosis), *of_others(diagnosis)]
    found += of_epoch(diagnosis)
    rows, left = diagnosis.rows, None
    is_used = ~(rows.is_far | np.isin(rows.exposure, diagnosis.swinging))
    share = (explained + of_each) / max(float(rows.chi2[is_used].sum()), 1e-300)
    if share <= _MOST_LINEAR:
        left, *_ = scatter = scatter_tests(
            rows, diagnosis.magnitude, explained + of_each, without=diagnosis.swinging
        )
        found += of_references(diagnosis)
        found += of_scatter(diagnosis, scatter) if share <= _MOST_BESIDE_NOISE else []
    # Tails spoil no positions, and make nothing but scatter.
    spoils = any(one.test.subject not in (*SCATTER, "kurtosis") for one in found)
    found.sort(key=lambda one: (spoils and one.test.subject == "kurtosis", -one.gain))
    if left is None and found[:1] == patterns[:1]:
        found = patterns
    swapped = wrong_identifications(diagnosis)
    if swapped and found and found[0].test.subject in (*SCATTER, *STARS):
        # They make both of these, and neither makes them.
        found = [*swapped, *(one for one in found if one.test.subject not in FAR_OFF)]
    divided = named_causes(found, diagnosis)
    named = divided.named
    rivals = [*(rivals if named[:1] == patterns[:1] else ()), *divided.rivals()]
    return FoundCauses(tuple(named), tuple(rivals[:_MOST_RIVALS]), left)


def _swinging(diagnosis: Diagnosis) -> list[Found]:
    test = next(one for one in diagnosis.tests if one.subject == "swing")
    if not len(diagnosis.swinging):
        return []
    items = tuple(int(one) for one in diagnosis.swinging)
    return [Found(test, gains.of_swings(diagnosis), items)]


def _of_exposures(diagnosis: Diagnosis, explained: float) -> tuple[list[Found], float]:
    """Return the cause that each exposure has a pattern of its own, and what it explains of chi2.

    It is the pattern that explains most, beyond what those of all exposures explain already.
    """
    tests = [one for one in diagnosis.tests if one.subject in OF_EXPOSURES]
    gained = [(*gains.of_each_exposure(diagnosis, one.subject), one) for one in tests]
    gain, of_each, best = max(gained, key=lambda one: one[0])
    if best.log_chance > limit_of(diagnosis) or best.statistic - best.expected < explained:
        return [], 0.0
    return [Found(best, gain)], of_each - explained


def wrong_identifications(diagnosis: Diagnosis) -> list[Found]:
    """Return measurements with each other's identification as a cause, if there are any."""
    pairs = diagnosis.swapped
    if pairs.log_chance > limit_of(diagnosis):
        return []
    test = next(one for one in diagnosis.tests if one.subject == "swapped")
    gain = gains.of_outliers(diagnosis)
    return [Found(test, gain, pairs.items, float(len(pairs.items)))]


def _of_outliers(diagnosis: Diagnosis) -> list[Found]:
    """Return outliers as a cause, or the wrong identifications that make most of them."""
    rows, swapped = diagnosis.rows, wrong_identifications(diagnosis)
    far = float(rows.chi2[rows.is_far].sum())
    if swapped and diagnosis.swapped.chi2 > _OF_OUTLIERS * far:
        return swapped
    test = next(one for one in diagnosis.tests if one.subject == "outliers")
    if test.log_chance > limit_of(diagnosis):
        return []
    return [Found(test, gains.of_outliers(diagnosis), size=float(rows.is_far.sum()))]
