"""What is expected by chance of the largest of several values."""

import math

from scipy.special import ndtri

RARE = 0.01
"""Probability of what chance is not expected to explain."""


def largest_by_chance(count: int, probability: float = RARE) -> float:
    """Return what the largest of `count` unit normal values exceeds, in absolute value, by chance.

    Šidák's limit. It is higher for independent values than for correlated ones, so that the
    probability of a false alarm is at most the one given.

    Parameters
    ----------
    count : number of values
    probability : that the largest is above the limit

    Raises
    ------
    ValueError
        If there is no value, or the probability is not between 0 and 1.
    """
    if count < 1 or not 0.0 < probability < 1.0:
        raise ValueError(
            "expected at least one value and a probability between 0 and 1, "
            f"found {count} and {probability}"
        )
    of_one = -math.expm1(math.log1p(-probability) / count)
    return float(-ndtri(0.5 * of_one))


def largest_chi2(count: int) -> float:
    """Return the chi2 of two degrees of freedom that the largest of `count` exceeds by chance.

    Parameters
    ----------
    count : number of independent values

    Raises
    ------
    ValueError
        If `count` is not positive.
    """
    if count < 1:
        raise ValueError(f"count: expected at least 1, found {count}")
    # The probability of a single value, without rounding for large counts.
    single = -math.expm1(math.log1p(-RARE) / count)
    return -2.0 * math.log(single)
