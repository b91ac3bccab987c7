"""Tests of the size of the residuals: overall, by exposure, source, magnitude; and their tails."""

from typing import NamedTuple

import numpy as np

from solver.results.diagnosis.rate import log_chance, log_chance_normal, log_chance_poisson
from solver.results.diagnosis.rows import Rows

# Chance of a good residual beyond `outliers.FAR` on either axis.
_FAR_BY_CHANCE = 4.0e-9
# Degrees of freedom below which a chi2 says nothing.
FEWEST = 2.0
# Of a measurement; those of which the fit leaves less are rounding errors.
_LEAST_DOF = 0.04


class Scatter(NamedTuple):
    """A test of the size of the residuals.

    Attributes
    ----------
    name : of the test
    value, expected, scatter : of the statistic, the last two for a good solution
    log_chance : logarithm of the probability of a value as far as this by chance
    freedom : number of degrees of freedom
    """

    name: str
    value: float
    expected: float
    scatter: float
    log_chance: float
    freedom: float = 1.0


def scatter_tests(
    rows: Rows, magnitude: np.ndarray, explained: float = 0.0, without: np.ndarray | None = None
) -> list[Scatter]:
    """Return the tests of the size of the residuals; the outliers have their own.

    Parameters
    ----------
    magnitude : of each source; NaN where unknown, or where chi2 is not only that of noise
    explained : chi2 that other causes explain
    without : indices of exposures to leave out
    """
    used = ~rows.is_far
    if without is not None and len(without):
        used &= ~np.isin(rows.exposure, without)
    weight = used.astype(float)
    chi2, dof = weight * rows.chi2, (2.0 * weight) * rows.left
    of_runs = rows.in_runs(chi2), rows.in_runs(dof)
    of_sources = [np.bincount(rows.source, one, len(magnitude)) for one in (chi2, dof)]
    total, freedom = float(of_runs[0].sum()) - explained, max(float(of_runs[1].sum()), 1.0)
    scale = max(total / freedom, 1e-300)
    whole = float(_normalised(np.array([total]), np.array([freedom]))[0])
    spread = float(np.sqrt(2.0 / freedom))
    # Groups are compared with each other: what is explained is in all of them.
    typical = max(float(of_runs[0].sum()) / freedom, 1e-300)
    for one in (of_runs[0], of_sources[0]):
        one /= typical
    found = [
        Scatter("noise", scale, 1.0, spread, log_chance_normal(whole), freedom),
        _dispersion("exposures", *(np.bincount(rows.exposure[rows.runs], one) for one in of_runs)),
        _dispersion("sources", *of_sources),
        _dispersion("detectors", *(np.bincount(rows.detector[rows.runs], one) for one in of_runs)),
    ]
    slope = _slope(magnitude, *of_sources)
    count, expected = int(rows.is_far.sum()), _FAR_BY_CHANCE * rows.n
    chance = log_chance_poisson(count, expected)
    far = Scatter("outliers", count, expected, float(np.sqrt(expected)), chance)
    tails = _kurtosis(rows, chi2, dof)
    return [*found, *([slope] if slope else []), far, tails]


def _normalised(chi2: np.ndarray, dof: np.ndarray) -> np.ndarray:
    """Return chi2 values as unit normal ones (Wilson and Hilferty)."""
    spread = 2.0 / (9.0 * dof)
    return (np.cbrt(np.maximum(chi2, 0.0) / dof) - (1.0 - spread)) / np.sqrt(spread)


def _dispersion(name: str, chi2: np.ndarray, dof: np.ndarray) -> Scatter:
    """Return whether the chi2 of groups scatter about their expected values as by chance."""
    known = dof > FEWEST
    z = _normalised(chi2[known], dof[known])
    freedom = max(float(known.sum()) - 1.0, 0.0)
    squares = float(np.sum(z**2))
    log_p = log_chance(squares, freedom) if freedom else 0.0
    value = squares / freedom if freedom else 1.0
    return Scatter(name, value, 1.0, float(np.sqrt(2.0 / max(freedom, 1.0))), log_p, freedom)


def _kurtosis(rows: Rows, chi2: np.ndarray, dof: np.ndarray) -> Scatter:
    """Return the excess kurtosis of a residual, whatever the scale of its exposure; normal is 0.

    Half of chi2 of both axes over its expected value is an exponential deviate, of which the
    second Laguerre polynomial has a mean of zero and a variance of one. The kurtosis is three
    times that mean (Mardia 1970). Exposures of different noise, together, would have one.
    """
    known = dof > _LEAST_DOF
    half = np.divide(chi2, dof, out=np.zeros(len(chi2)), where=known)
    counts = rows.in_exposures(known.astype(float))
    mean = rows.in_exposures(half) / np.maximum(counts, 1.0)
    squares = rows.in_exposures(np.square(half, out=half)) / np.maximum(mean**2, 1e-300)
    # Squares of exponential deviates over the mean of n of them are 2 n / (n + 1) on average.
    squares *= (counts + 1.0) / np.maximum(counts, 1.0)
    n = max(float(counts.sum()), 1.0)
    value = 3.0 * float(np.sum(0.5 * squares - counts)) / n
    scatter = 3.0 / float(np.sqrt(n))
    chance = log_chance_normal(value / scatter)
    return Scatter("kurtosis", value, 0.0, scatter, chance, n)


def _slope(magnitude: np.ndarray, chi2: np.ndarray, dof: np.ndarray) -> Scatter | None:
    """Return whether chi2 of sources over its expected value changes with the magnitude.

    Per magnitude; all of shape (sources,).
    """
    known = np.isfinite(magnitude) & (dof > 0.0)
    if not known.any() or float(np.ptp(magnitude[known])) == 0.0:
        return None
    weight, at = dof[known], magnitude[known]
    centred = at - np.average(at, weights=weight)
    squares = float(np.sum(weight * centred**2))
    value = float(np.sum(centred * chi2[known]) / squares)
    scatter = float(np.sqrt(2.0 / squares))
    return Scatter("magnitudes", value, 0.0, scatter, log_chance_normal(value / scatter))
