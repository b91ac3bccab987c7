"""Table of the mean and the scatter of the residuals in bins of time, magnitude and place."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.bin_shares import BinShares
from plateviz.tables.chance import largest_by_chance
from plateviz.tables.exposures import minutes_since_first
from plateviz.tables.focal_residuals import focal_residuals
from solver.data.instrument import Instrument
from solver.data.result import FitResult
from solver.problem.term_factors import orbital_phase
from solver.units import MPIX_PER_PIX

_BINS = 16
# Bins with fewer measurements have no row.
_FEWEST = 20
# Means of which the fit leaves a smaller share are rounding errors.
_LEAST_SHARE = 0.02
_BAND_SIGMAS = 2.0
# Share of the sources that are in the first and in the last bin of magnitude whatever they have.
_RARE = 0.01
_SERIES = {"mean x": "pull_x", "mean y": "pull_y", "scatter": "pull_chi2"}


class _Binned(NamedTuple):
    """A quantity and the bin of each measurement.

    Attributes
    ----------
    name, unit : in words
    values : of each measurement, shape (n,)
    cells : bin of each measurement, `_BINS` where the quantity is not known, shape (n,)
    """

    name: str
    unit: str
    values: np.ndarray
    cells: np.ndarray


class _Summed(NamedTuple):
    """What is summed in the bins.

    Attributes
    ----------
    weights, sums : inverse variance and weighted residual along x and y, mpix^-2 and mpix^-1
    chi2, dof : of each measurement, and what is expected of it, shape (n,)
    """

    weights: list[np.ndarray]
    sums: list[np.ndarray]
    chi2: np.ndarray
    dof: np.ndarray


def binned_residuals(result: FitResult, instrument: Instrument) -> pd.DataFrame:
    """Return the mean and the scatter of the residuals in bins of several quantities.

    The quantities are the time, the phase of the satellite's orbit where the exposures cover more
    than one period, the magnitude of the source where one is known, the pixel phase (fraction of
    the measured position) and the place on the detector. Bins of time have about as many
    measurements each, those of the others are equally wide.

    The fit absorbs a share of a displacement that all measurements of a bin have. Source positions,
    exposures, detectors and distortion are taken into account (`BinShares`), so that the mean has
    the size of the displacement. Its sigma is right to about 5 % for a fit of the paper's model;
    optional groups of parameters absorb more, which makes the pulls smaller. The scatter is
    chi2 over its expectation, which allows for the leverage of each measurement.

    Parameters
    ----------
    result : the fit
    instrument : of the fit; gives the order and the size of the detectors

    Returns
    -------
    A row per quantity and bin: `quantity`, `unit`, `centre` (mean of the quantity), `n`
    (measurements), and along x and y of the detectors `mean_x_mpix`, `sigma_x_mpix` (expected by
    chance), `pull_x` (their ratio), `mean_x_mas`, `sigma_x_mas`; NaN where the fit absorbs nearly
    all. Then `chi2_per_dof` (expected 1), `sigma_chi2` (expected by chance) and `pull_chi2`
    """
    found = focal_residuals(result, instrument)
    turn = np.radians(result.values_on("det")["detector_rotation"].to_numpy())[found.detector]
    shares = BinShares(result, found, turn)
    rows = result.residuals
    residuals = [MPIX_PER_PIX * rows[f"residual_{axis}"].to_numpy() for axis in "xy"]
    weights = [np.square(1.0 / (MPIX_PER_PIX * rows[f"s{axis}"].to_numpy())) for axis in "xy"]
    sums = [weight * residual for weight, residual in zip(weights, residuals, strict=True)]
    chi2 = sums[0] * residuals[0] + sums[1] * residuals[1]
    summed = _Summed(weights, sums, chi2, 2.0 * (1.0 - found.leverage))
    parts = [
        _rows(one, summed, shares(one.cells, _BINS), found.mas_per_mpix)
        for one in _quantities(result, instrument, found.source)
    ]
    table = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return pd.DataFrame(table)


def _rows(
    one: _Binned, summed: _Summed, share: np.ndarray, mas_per_mpix: float
) -> dict[str, np.ndarray]:
    """Return the columns of a quantity; `share` is what the fit leaves of each bin, (bins, 2)."""

    def totals(values: np.ndarray | None) -> np.ndarray:
        return np.bincount(one.cells, values, minlength=_BINS + 1)[:_BINS]

    n, dof = totals(None), totals(summed.dof)
    is_known = (n >= _FEWEST) & (dof > 0.0)
    n, dof = n[is_known], dof[is_known]
    columns = {
        "quantity": np.full(len(n), one.name, dtype=object),
        "unit": np.full(len(n), one.unit, dtype=object),
        "centre": totals(one.values)[is_known] / n,
        "n": n,
    }
    for number, axis in enumerate("xy"):
        left, total = share[is_known, number], totals(summed.weights[number])[is_known]
        free = np.where(left >= _LEAST_SHARE, left * total, np.nan)
        mean, sigma = totals(summed.sums[number])[is_known] / free, 1.0 / np.sqrt(free)
        columns |= {f"mean_{axis}_mpix": mean, f"sigma_{axis}_mpix": sigma}
        columns[f"pull_{axis}"] = mean / sigma
        columns |= {
            f"mean_{axis}_mas": mean * mas_per_mpix,
            f"sigma_{axis}_mas": sigma * mas_per_mpix,
        }
    chi2, sigma = totals(summed.chi2)[is_known] / dof, np.sqrt(2.0 / dof)
    return columns | {
        "chi2_per_dof": chi2,
        "sigma_chi2": sigma,
        "pull_chi2": (chi2 - 1.0) / sigma,
    }


class BinStatistics(NamedTuple):
    """Summary of a table of `binned_residuals`, or of rows of it.

    Attributes
    ----------
    values : number of means and scatters
    beyond : number of them beyond two sigma
    expected : the number beyond two sigma by chance
    largest : largest departure from expectation over its sigma, absolute value
    of_largest : what that is: "mean x", "mean y" or "scatter"
    limit : what the largest of so many exceeds in 1 % of orbits by chance
    """

    values: int
    beyond: int
    expected: float
    largest: float
    of_largest: str
    limit: float


def bin_statistics(table: pd.DataFrame) -> BinStatistics:
    """Return the summary of rows of `binned_residuals`, of which there is at least one."""
    pulls = table[list(_SERIES.values())].abs()
    values, largest = int(pulls.count().sum()), pulls.max()
    return BinStatistics(
        values=values,
        beyond=int((pulls > _BAND_SIGMAS).sum().sum()),
        expected=0.0455 * values,
        largest=float(largest.max()),
        of_largest=list(_SERIES)[int(np.nanargmax(largest.to_numpy()))],
        limit=largest_by_chance(values),
    )


def _quantities(result: FitResult, instrument: Instrument, source: np.ndarray) -> Iterator[_Binned]:
    """Yield the quantities that are known; `source` is that of each measurement."""
    rows, exposure = result.residuals, result.exposure_index
    minutes = minutes_since_first(result.exposures)
    counts = np.bincount(exposure, minlength=len(minutes))
    cells = _equal_counts(minutes, counts)
    yield _Binned("time", "min", minutes[exposure], cells[exposure])
    period = result.settings.breathing_period
    # The phase of less than a period is the time by another name.
    if np.ptp(minutes) > period:
        times = result.exposures["obstime"].to_numpy(dtype=float)
        turns = orbital_phase(times, period) / (2.0 * np.pi)
        phase = turns - np.floor(turns)
        cells = _equal_widths(phase, 0.0, 1.0)
        yield _Binned("orbital phase", "periods", phase[exposure], cells[exposure])
    # Results of old versions have no magnitudes.
    magnitude = result.sources.get("magnitude", pd.Series(np.nan, result.sources.index))
    magnitude = magnitude.to_numpy(dtype=float)
    is_known = np.isfinite(magnitude)
    if is_known[source].any():
        # Few are much brighter than all others.
        low, high = np.quantile(magnitude[is_known], (_RARE, 1.0 - _RARE))
        known = np.where(is_known, magnitude, low)
        cells = np.where(is_known, _equal_widths(known, low, max(high, low + 0.1)), _BINS)
        yield _Binned("magnitude", "mag", known[source], cells[source])
    for axis in "xy":
        at = rows[f"n{axis}"].to_numpy()
        half = 0.5 * max(getattr(detector, f"n_{axis}") for detector in instrument.detectors)
        yield _Binned(f"place along {axis}", "pixel", at, _equal_widths(at, -half, half))
    for axis in "xy":
        at = rows[f"n{axis}"].to_numpy()
        phase = at - np.floor(at)
        cells = _equal_widths(phase, 0.0, 1.0)
        yield _Binned(f"pixel phase in {axis}", "pixel", phase, cells)


def _equal_widths(values: np.ndarray, low: float, high: float) -> np.ndarray:
    return np.clip((_BINS / (high - low) * (values - low)).astype(np.int64), 0, _BINS - 1)


def _equal_counts(values: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return the bin of each exposure, so that bins have about as many measurements.

    Parameters
    ----------
    values : of exposures
    counts : measurements of each
    """
    order = np.argsort(values, kind="stable")
    before = np.cumsum(counts[order]) - 0.5 * counts[order]
    cells = np.empty(len(values), dtype=np.int64)
    cells[order] = (_BINS * before / max(counts.sum(), 1)).astype(np.int64)
    return np.minimum(cells, _BINS - 1)
