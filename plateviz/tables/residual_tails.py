"""Tables of the tails of the residuals: how many are large, and the kurtosis, against chance."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy.special import erfc, ndtr, ndtri, pdtrik

from plateviz.tables.labels import exposure_labels
from solver.data.result import FitResult
from solver.results.diagnosis.outliers import are_outliers

THRESHOLDS = tuple(np.arange(1.0, 6.1, 0.5))
"""Thresholds of the standardised residual, absolute value."""
AXIS, EXPOSURE, DETECTOR = "axis", "exposure", "detector"
# Number of sigmas that the ranges by chance reach to both sides.
_REACH = 2.0
# Median of the absolute value of a unit normal value.
_MEDIAN = float(ndtri(0.75))
# Measurements of which the fit leaves less than this share do not count.
_LEAST_LEFT = 0.02
# Fewer measurements of an exposure have no kurtosis.
_FEWEST = 8


def residual_tails(result: FitResult, thresholds: Sequence[float] = THRESHOLDS) -> pd.DataFrame:
    """Return how many standardised residuals are beyond each threshold, and what chance makes.

    The expected number is that of a unit normal distribution. Its variance is the binomial one,
    and more than that by what residuals of the same source or exposure have in common: the fit
    correlates them. That is a few percent of a full orbit.

    Parameters
    ----------
    result : the fit
    thresholds : absolute values of the standardised residual, which is corrected for leverage

    Returns
    -------
    A row per axis ("x", "y") and threshold: `axis`, `threshold`, `found` (residuals beyond it, on
    both sides), `expected`, `scatter` (standard deviation by chance), `low`, `high` (between which
    chance leaves the number, but for 2.3 % at most on each side), `is_beyond` (whether it is not),
    `ratio` (found over expected), `of_width` (expected of a normal distribution of the measured
    width), and repeated: `n` (residuals), `width` (of both axes, from the median, which tails
    hardly change)
    """
    at = np.asarray(thresholds, dtype=float)
    pairs = result.residuals[["standardised_x", "standardised_y"]].to_numpy()
    sizes = [np.sort(np.abs(values[np.isfinite(values)])) for values in pairs.T]
    everything = np.concatenate(sizes)
    width = float(np.median(everything)) / _MEDIAN if len(everything) else 1.0
    leverage = np.clip(0.5 * result.residuals["leverage"].to_numpy(), 0.0, 1.0 - _LEAST_LEFT)
    # Sum of the squared correlations of each residual with all others on its axis.
    shared = float(np.sum(leverage / (1.0 - leverage)))
    return pd.concat(
        [_of_axis(axis, at, size, shared, width) for axis, size in zip("xy", sizes, strict=True)],
        ignore_index=True,
    )


def _of_axis(
    axis: str, at: np.ndarray, sizes: np.ndarray, shared: float, width: float
) -> pd.DataFrame:
    """Return the rows of one axis, from its absolute values in ascending order."""
    count = len(sizes)
    found = count - np.searchsorted(sizes, at, side="right")
    chance = _beyond(at)
    expected = count * chance
    # A correlation enters the variance of a count by its square, times that of the second Hermite
    # polynomial in whether a value is beyond the threshold.
    slope = 2.0 * at * np.exp(-0.5 * at**2) / np.sqrt(2.0 * np.pi)
    variance = expected * (1.0 - chance) + 0.5 * slope**2 * shared
    low, high = _range(expected, variance)
    return pd.DataFrame(
        {
            "axis": axis,
            "threshold": at,
            "found": found,
            "expected": expected,
            "scatter": np.sqrt(variance),
            "low": low,
            "high": high,
            "is_beyond": (found < low) | (found > high),
            "ratio": found / np.maximum(expected, 1e-300),
            "of_width": count * _beyond(at / max(width, 1e-300)),
            "n": count,
            "width": width,
        }
    )


def _beyond(threshold: np.ndarray) -> np.ndarray:
    """Return the share of a unit normal distribution beyond a threshold, on both sides."""
    return erfc(threshold / np.sqrt(2.0))


def _range(expected: np.ndarray, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of the range of a number by chance, with 2.3 % at most beyond each.

    The numbers are those of Poisson's distribution, in steps by which the variance is right: of
    one for rare ones. The ends are half a step beyond the last number that is within.
    """
    step = np.where(expected > 0.0, variance / np.maximum(expected, 1e-300), 1.0)
    mean = np.maximum(expected / step, 1e-300)
    # The inverse is not whole; for rare numbers it is zero.
    least, most = (
        np.ceil(np.nan_to_num(pdtrik(chance, mean))) for chance in (ndtr(-_REACH), ndtr(_REACH))
    )
    return np.maximum(step * (least - 0.5), 0.0), step * (most + 0.5)


def kurtosis_by_group(result: FitResult) -> pd.DataFrame:
    """Return the excess kurtosis of the residuals along each axis, of each exposure and detector.

    That of exposures and detectors is of both axes, by the definition of the tests of the solution
    (`solver.results.diagnosis.scatter`): whatever the scale of an exposure, and without outliers.
    The mean over the exposures, weighted by `n`, is the value of the test, unless that leaves out
    exposures. It is skewed by chance, and its range allows for that: the squares of exponential
    values over the square of their sum are those of the spacings of random points, of which the
    moments are known (Greenwood 1946).

    Returns
    -------
    A row per axis, then per exposure and per detector: `kind` ("axis", "exposure", "detector"),
    `index` (order in its kind), `name` (text), `exposure` (the same, empty for others), `n`
    (measurements), `kurtosis` (0 is normal), `scatter` (standard deviation by chance), `low`,
    `high` (range of two sigma), `sigmas` (as those of a unit normal value). Exposures and detectors
    of fewer than eight measurements have no row
    """
    order = np.argsort(result.exposure_index, kind="stable")
    columns = ["detector_id", "leverage", "residual_x", "residual_y", "sx", "sy"]
    rows, exposure = result.residuals[columns].iloc[order], result.exposure_index[order]
    left = 1.0 - np.clip(0.5 * rows["leverage"].to_numpy(), 0.0, 1.0)
    size = np.maximum(left, _LEAST_LEFT)
    squares = np.stack(
        [np.square(rows[f"residual_{axis}"] / rows[f"s{axis}"]).to_numpy() / size for axis in "xy"]
    )
    used = (left > _LEAST_LEFT) & ~are_outliers(squares.max(axis=0), exposure)
    squares, exposure = squares[:, used], exposure[used]
    detector, detectors = pd.factorize(rows["detector_id"].to_numpy()[used], sort=True)
    terms = _polynomial(squares.mean(axis=0), exposure)
    labels = exposure_labels(result.exposures).to_numpy()
    of_exposures = _groups(EXPOSURE, exposure, terms, labels)
    found = [
        *(_axis_kurtosis(number, of_axis, exposure) for number, of_axis in enumerate(squares)),
        of_exposures.assign(exposure=of_exposures["name"]),
        _groups(DETECTOR, detector, terms, detectors.astype(str)),
    ]
    return pd.concat(found, ignore_index=True).fillna({"exposure": ""})


def _polynomial(half: np.ndarray, exposure: np.ndarray) -> np.ndarray:
    """Return the terms whose mean is the kurtosis of both axes together (Mardia 1970).

    Parameters
    ----------
    half : half of the chi2 of both axes over its expected value, an exponential value
    exposure : of each measurement
    """
    half, n = _of_unit_mean(half, exposure)
    return 3.0 * (0.5 * (n + 1.0) / n * half**2 - 2.0 * half + 1.0)


def _axis_kurtosis(number: int, squares: np.ndarray, exposure: np.ndarray) -> pd.DataFrame:
    """Return the row of one axis: the mean of the fourth Hermite polynomial."""
    squares, n = _of_unit_mean(squares, exposure)
    terms = (n + 2.0) / n * squares**2 - 6.0 * squares + 3.0
    count, value = len(terms), float(terms.mean()) if len(terms) else 0.0
    scatter = float(np.sqrt(24.0 / max(count, 1)))
    return pd.DataFrame(
        {
            **{"kind": AXIS, "index": [number], "name": "xy"[number], "n": count},
            **{"kurtosis": value, "scatter": scatter, "sigmas": value / scatter},
            **{"low": -_REACH * scatter, "high": _REACH * scatter},
        }
    )


def _of_unit_mean(values: np.ndarray, exposure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return values over the mean of their exposure, and the number of these."""
    count = np.bincount(exposure)
    mean = np.bincount(exposure, values) / np.maximum(count, 1)
    return values / np.maximum(mean, 1e-300)[exposure], count[exposure]


def _groups(kind: str, group: np.ndarray, terms: np.ndarray, names: np.ndarray) -> pd.DataFrame:
    """Return the rows of the groups that have enough measurements.

    Parameters
    ----------
    group : of each measurement
    terms : whose mean is the kurtosis
    names : of the groups
    """
    count = np.bincount(group, minlength=len(names))
    known = np.flatnonzero(count >= _FEWEST)
    n = count[known].astype(float)
    value = np.bincount(group, terms, minlength=len(names))[known] / n
    scatter = 3.0 * np.sqrt((n - 1.0) / ((n + 2.0) * (n + 3.0)))
    skewness = (
        2.0
        * (5.0 * n - 7.0)
        / ((n + 4.0) * (n + 5.0))
        / np.sqrt((n - 1.0) / ((n + 2.0) * (n + 3.0)))
    )
    # A gamma distribution of this skewness, whose cube root is nearly normal (Wilson, Hilferty).
    shape = 4.0 / skewness**2
    centre, spread = 1.0 - 1.0 / (9.0 * shape), 1.0 / (3.0 * np.sqrt(shape))
    cube = np.maximum(1.0 + value / (scatter * np.sqrt(shape)), 0.0)
    low, high = (
        scatter * np.sqrt(shape) * ((centre + side * spread) ** 3 - 1.0)
        for side in (-_REACH, _REACH)
    )
    return pd.DataFrame(
        {
            **{"kind": kind, "index": known, "name": names[known], "n": count[known]},
            **{"kurtosis": value, "scatter": scatter, "sigmas": (np.cbrt(cube) - centre) / spread},
            **{"low": low, "high": high},
        }
    )
