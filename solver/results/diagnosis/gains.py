"""How much more likely a cause makes the residuals: one measure for causes of all kinds.

A gain is twice the logarithm of the largest likelihood with the cause over that without it, less
`PER_PARAMETER` for each parameter of the cause, so that the simpler of two explanations is taken.
"""

import numpy as np

from solver.results.diagnosis.exposures import WAVES
from solver.results.diagnosis.patterns import Family
from solver.results.diagnosis.projection import Projection
from solver.results.diagnosis.scatter import Scatter
from solver.results.diagnosis.table import Diagnosis
from solver.results.diagnosis.test import Test

PER_PARAMETER = 4.0
# Phases of an oscillation that are tried. A phase has a range, and explains less by chance than a
# parameter without one: with this, an oscillation is taken for a drift as seldom as the reverse.
_PHASES, _PER_PHASE = 24, 3.0


def of_pattern(projection: Projection, family: Family, test: Test, scale: float) -> float:
    """Return the gain of a family of patterns.

    An oscillation has one phase, common to its terms: two free courses in time would describe
    what merely drifts as well.

    Parameters
    ----------
    test : of the family
    scale : chi2 per degree of freedom, by which that of the patterns is divided
    """
    if family.subject != "bend":
        return test.statistic - PER_PARAMETER * test.expected
    n = len(family.columns) // 2
    angles = np.pi * np.arange(_PHASES) / _PHASES
    found = [
        projection.evidence(
            family._replace(weights=np.kron([[np.cos(one)], [np.sin(one)]], np.eye(n)))
        )
        for one in angles
    ]
    best = max(found, key=lambda one: one.chi2)
    return best.chi2 / scale - PER_PARAMETER * best.dof - _PER_PHASE


def of_scale(ratio: float, freedom: float) -> float:
    """Return the gain of one factor on the scatter of values.

    Parameters
    ----------
    ratio : of their squares to what is expected
    freedom : number of values
    """
    return freedom * (ratio - 1.0 - float(np.log(max(ratio, 1e-300)))) - PER_PARAMETER


def of_each_exposure(diagnosis: Diagnosis, subject: str) -> tuple[float, float]:
    """Return the gain of patterns that all exposures have, each its own, and what they explain.

    The amounts are normal deviates, so that the gain is that of the one factor on their scatter.
    """
    found = diagnosis.exposures
    values = np.delete(getattr(found, subject) * found.scale, diagnosis.swinging)
    each = 6 if subject == "quadratic" else 1
    total, freedom = float(values.sum()), float(each * len(values))
    return of_scale(max(total / freedom, 1.0), freedom), max(total - freedom, 0.0)


def of_swings(diagnosis: Diagnosis) -> float:
    """Return the gain of the pointing of some exposures that swings."""
    found = diagnosis.exposures
    explained = (found.swing * found.scale)[diagnosis.swinging]
    return float(np.sum(explained - PER_PARAMETER * 4.0 * WAVES))


def of_groups(noise: Scatter, groups: Scatter) -> float:
    """Return the gain of a noise of each group, which includes that of the noise as a whole."""
    squares = groups.value * groups.freedom - PER_PARAMETER * (groups.freedom + 1.0)
    return of_scale(noise.value, noise.freedom) + PER_PARAMETER + squares


def of_slope(noise: Scatter, slope: Scatter) -> float:
    """Return the gain of a noise that depends on magnitude, which includes noise as a whole."""
    squares = (slope.value / slope.scatter) ** 2
    return of_scale(noise.value, noise.freedom) + squares - PER_PARAMETER


def of_kurtosis(kurtosis: Scatter) -> float:
    """Return the gain of a noise with other tails, but of the stated size.

    It grows with the square of a small kurtosis, and slowly with a large one, which sources of
    different noise make.
    """
    n, squares = kurtosis.freedom, (kurtosis.value / kurtosis.scatter) ** 2
    return n * float(np.log1p(squares / n)) - PER_PARAMETER


def of_outliers(diagnosis: Diagnosis) -> float:
    """Return the gain of leaving out the outliers, by the scatter of the other residuals."""
    rows = diagnosis.rows
    chi2 = float(rows.chi2[rows.is_far].sum()) / diagnosis.scale
    return chi2 - 2.0 * PER_PARAMETER * float(rows.is_far.sum())
