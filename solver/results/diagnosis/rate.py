"""Probabilities of a statistic by chance, in sigmas, and the rate of false discoveries."""

import numpy as np
from scipy.special import bdtrc, chdtrc, gammainc, gammaln, log_ndtr, ndtri_exp

# Larger chi2 are no more certain, and may be infinite.
_LARGEST = 1e9


def log_chance(chi2: float, dof: float) -> float:
    """Return the logarithm of the probability that chance makes a chi2 larger than `chi2`.

    It does not underflow: far in the tail it is the first terms of the asymptotic series.
    """
    if dof <= 0.0 or not chi2 > 0.0:
        return 0.0
    chi2 = min(chi2, _LARGEST)
    chance = float(chdtrc(dof, chi2))
    if chance > 1e-280:
        return float(np.log(chance))
    half, shape = 0.5 * chi2, 0.5 * dof
    ratio = min((shape - 1.0) / half, 0.99)
    return float((shape - 1.0) * np.log(half) - half - gammaln(shape) - np.log1p(-ratio))


def log_chance_normal(z: float, *, sides: int = 2) -> float:
    """Return the logarithm of the probability of a unit normal value at least as far as `z`.

    Parameters
    ----------
    sides : 2 for both tails, 1 for the upper one
    """
    if not np.isfinite(z):
        return -0.5 * _LARGEST if z > 0.0 else 0.0
    if sides == 2:
        return float(min(np.log(2.0) + log_ndtr(-abs(z)), 0.0))
    return float(log_ndtr(-z))


def log_chance_poisson(count: int, expected: float) -> float:
    """Return the logarithm of the probability that chance makes as many as `count`, or more."""
    if count <= 0:
        return 0.0
    chance = float(gammainc(count, expected))
    if chance > 0.0:
        return float(np.log(chance))
    # The first term of the sum, far in the tail.
    return float(count * np.log(max(expected, 1e-300)) - expected - gammaln(count + 1.0))


def log_chance_binomial(count: int, total: int, rate: float) -> float:
    """Return the logarithm of the probability of `count` or more of `total` at a rate of each."""
    if count <= 0:
        return 0.0
    chance = float(bdtrc(count - 1, total, rate))
    if chance > 0.0:
        return float(np.log(chance))
    # The first term of the sum, far in the tail.
    ways = gammaln(total + 1.0) - gammaln(count + 1.0) - gammaln(total - count + 1.0)
    return float(ways + count * np.log(rate) + (total - count) * np.log1p(-rate))


def sigmas(log_probability: float) -> float:
    """Return the distance in sigmas at which a unit normal value has this two-sided chance."""
    if log_probability >= 0.0:
        return 0.0
    return float(-ndtri_exp(log_probability - np.log(2.0)))


def of_many(log_probability: float, count: int) -> float:
    """Return the logarithm of the chance that the most extreme of `count` values is this far."""
    if log_probability < -30.0:
        return min(log_probability + np.log(max(count, 1)), 0.0)
    return float(np.log(-np.expm1(count * np.log1p(-min(np.exp(log_probability), 1.0 - 1e-16)))))


def discoveries(log_probabilities: np.ndarray, rate: float) -> np.ndarray:
    """Return which tests are discoveries, with a share `rate` of false ones (Benjamini, Hochberg).

    If all is well, the probability of any discovery is `rate`. Dependent tests that tend to be
    high together, as those of overlapping patterns, only lower it.

    Parameters
    ----------
    log_probabilities : of each test by chance; NaN where a test could not be made
    """
    known = np.flatnonzero(~np.isnan(log_probabilities))
    order = known[np.argsort(log_probabilities[known])]
    limits = np.log(rate * np.arange(1, len(order) + 1) / max(len(order), 1))
    below = np.flatnonzero(log_probabilities[order] <= limits)
    found = np.zeros(len(log_probabilities), dtype=bool)
    if len(below):
        found[order[: below[-1] + 1]] = True
    return found
