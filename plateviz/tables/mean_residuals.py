"""Table of the mean residuals in bins over the detectors, and its summary."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.chance import largest_by_chance
from plateviz.tables.focal_residuals import FocalResiduals, focal_residuals
from solver.data.instrument import Detector, Instrument
from solver.data.result import FitResult
from solver.units import UM_PER_MM

# Enough measurements in a bin for a mean that is much smaller than a single residual.
_PER_BIN = 50
_FEWEST_BINS, _MOST_BINS = 4, 12
# Bins that keep less than this share of the typical weight, or of their own, have no row.
_LEAST_SHARE, _LEAST_KEPT = 0.25, 0.02
# Pointing, roll and focal length.
_OF_EXPOSURES = 4.0


def mean_residuals(
    result: FitResult, instrument: Instrument, *, bins: int | None = None
) -> pd.DataFrame:
    """Return the mean residual in square bins over the detectors, corrected for leverage.

    The fitted positions of the sources absorb a share of a displacement in a bin, and all of it
    where every source is measured in that bin only. The mean is the sum of the weighted residuals
    over the weights that are left, so that it has the size of the displacement; its variance is
    the inverse of these weights. The mean of the residuals as they are would be smaller by half,
    and its scatter would not be sigma over the root of n. The calibration absorbs as many of the
    means as it has parameters, a few percent of a full orbit, which is taken from all bins alike.

    Parameters
    ----------
    result : the fit
    instrument : of the fit; gives the outlines of the detectors
    bins : number of bins along the longer side of a detector; None for about 50 measurements
        in each, from 4 to 12

    Returns
    -------
    A row per bin: `detector_id`, `left`, `right`, `bottom`, `top` (mm on the focal plane), `n`
    (measurements), and for x and y `mean_x_mpix`, `sigma_x_mpix` (expected by chance),
    `pull_x` (their ratio), `mean_x_mas`, `sigma_x_mas`. Bins with few measurements, or where
    the sources absorb nearly all, have no row
    """
    found = focal_residuals(result, instrument)
    if bins is None:
        wanted = int(np.sqrt(len(found) / (_PER_BIN * len(instrument.detectors))))
        bins = min(max(wanted, _FEWEST_BINS), _MOST_BINS)
    table, cells = square_bins(found, instrument, bins)
    table["n"] = np.bincount(cells, minlength=len(table))
    kept, weighted = found.kept_by_sources(cells, len(table)), found.weight * found.vector
    own = [np.bincount(cells, of_axis, minlength=len(table)) for of_axis in found.weight.T]
    least = kept.min(axis=1)
    is_known = (least > _LEAST_KEPT * np.max(own, axis=0)) & (least > 0.0)
    if is_known.any():
        is_known &= least >= _LEAST_SHARE * np.median(least[is_known])
    share = _share_left(result, int(is_known.sum()))
    is_known &= share > 0.0
    known = table[is_known].reset_index(drop=True)
    for number, axis in enumerate("xy"):
        left = share * kept[is_known, number]
        sums = np.bincount(cells, weighted[:, number], minlength=len(table))[is_known]
        known[f"mean_{axis}_mpix"] = sums / left
        known[f"sigma_{axis}_mpix"] = 1.0 / np.sqrt(left)
        known[f"pull_{axis}"] = sums / np.sqrt(left)
        for name in (f"mean_{axis}", f"sigma_{axis}"):
            known[f"{name}_mas"] = known[f"{name}_mpix"] * found.mas_per_mpix
    return known


class MapStatistics(NamedTuple):
    """Summary of a table of `mean_residuals`.

    Attributes
    ----------
    n : measurements
    bins : number of bins
    sigma_mpix, sigma_mas : mean of a typical bin by chance, in one axis
    spread, spread_scatter : rms of the means over what is expected by chance, both axes, and the
        standard deviation of it
    largest : largest mean over its sigma, absolute value, of both axes
    limit : what the largest of so many exceeds in 1 % of maps by chance
    """

    n: int
    bins: int
    sigma_mpix: float
    sigma_mas: float
    spread: float
    spread_scatter: float
    largest: float
    limit: float


def map_statistics(table: pd.DataFrame) -> MapStatistics:
    """Return the summary of a table of `mean_residuals` that is not empty."""
    pulls = table[["pull_x", "pull_y"]].to_numpy()
    return MapStatistics(
        n=int(table["n"].sum()),
        bins=len(table),
        sigma_mpix=float(np.median(table[["sigma_x_mpix", "sigma_y_mpix"]])),
        sigma_mas=float(np.median(table[["sigma_x_mas", "sigma_y_mas"]])),
        **_against_chance(pulls),
    )


def _against_chance(pulls: np.ndarray) -> dict[str, float]:
    """Return the scatter of means over their sigmas, and the largest, against chance."""
    return {
        "spread": float(np.sqrt(np.mean(pulls**2))),
        "spread_scatter": 1.0 / float(np.sqrt(2.0 * pulls.size)),
        "largest": float(np.abs(pulls).max()),
        "limit": largest_by_chance(pulls.size),
    }


def detector_statistics(table: pd.DataFrame) -> pd.DataFrame:
    """Return the summary of a table of `mean_residuals` by detector.

    Returns
    -------
    A row per detector with bins, in their order: `detector_id`, `n` (measurements), `bins`, the
    columns `spread`, `spread_scatter`, `largest` and `limit` of `MapStatistics`, of this detector
    alone, and `is_beyond` (whether the largest exceeds the limit)
    """
    rows = [
        {
            "detector_id": detector_id,
            "n": int(bins["n"].sum()),
            "bins": len(bins),
            **_against_chance(bins[["pull_x", "pull_y"]].to_numpy()),
        }
        for detector_id, bins in table.groupby("detector_id", sort=False)
    ]
    names = ["detector_id", "n", "bins", "spread", "spread_scatter", "largest", "limit"]
    found = pd.DataFrame(rows, columns=names)
    return found.assign(is_beyond=found["largest"] > found["limit"])


def square_bins(
    found: FocalResiduals, instrument: Instrument, bins: int
) -> tuple[pd.DataFrame, np.ndarray]:
    """Return the bins over the detectors, a row each, and the row of each measurement.

    Parameters
    ----------
    found : residuals of n measurements
    instrument : gives the outlines of the detectors
    bins : number of bins along the longer side of a detector

    Returns
    -------
    Table of `detector_id`, `left`, `right`, `bottom`, `top` (mm on the focal plane), and an array
    of shape (n,)
    """
    grids = [_grid(detector, bins) for detector in instrument.detectors]
    return pd.concat(grids, ignore_index=True), _cells(found.at, found.detector, grids)


def _grid(detector: Detector, bins: int) -> pd.DataFrame:
    """Return the bins over one detector, row by row, with sides along the focal plane's axes."""
    corners = detector.corners_um() / UM_PER_MM
    low, high = corners.min(axis=0), corners.max(axis=0)
    columns, rows = np.maximum(np.round((high - low) / (high - low).max() * bins), 1).astype(int)
    x, y = np.linspace(low[0], high[0], columns + 1), np.linspace(low[1], high[1], rows + 1)
    return pd.DataFrame(
        {
            "detector_id": detector.detector_id,
            "left": np.tile(x[:-1], rows),
            "right": np.tile(x[1:], rows),
            "bottom": np.repeat(y[:-1], columns),
            "top": np.repeat(y[1:], columns),
        }
    )


def _share_left(result: FitResult, bins: int) -> float:
    """Return the share of the means of `bins` bins, of both axes, that the calibration leaves.

    A parameter of a detector or of the distortion absorbs as much as its prior lets it.
    """
    fitted = sum(
        float((1.0 - result.values_on(axis, "prior_share")).sum().sum()) for axis in ("det", "coef")
    )
    return max(0.0, 1.0 - (_OF_EXPOSURES + fitted) / max(2.0 * bins, 1.0))


def _cells(at: np.ndarray, detector: np.ndarray, grids: list[pd.DataFrame]) -> np.ndarray:
    """Return the row of each measurement in the grids one below the other."""
    cells, first = np.zeros(len(at), dtype=np.int64), 0
    for number, grid in enumerate(grids):
        on = detector == number
        # The fitted detector may be a few micrometres away from its nominal place.
        column, row = (
            np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 1)
            for edges, values in (
                (grid["left"].unique(), at[on, 0]),
                (grid["bottom"].unique(), at[on, 1]),
            )
        )
        cells[on] = first + row * grid["left"].nunique() + column
        first += len(grid)
    return cells
