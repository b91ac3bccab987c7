"""Table of the mean residuals of each field against those of the other fields."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.chance import largest_by_chance
from plateviz.tables.focal_residuals import FocalResiduals, focal_residuals
from plateviz.tables.mean_residuals import square_bins
from solver.data.instrument import Instrument
from solver.data.result import FitResult

_PER_BIN = 200
_FEWEST_BINS, _MOST_BINS = 2, 5
# Of the weight in a bin, the least share that the positions of the sources have to leave.
_LEAST_KEPT = 0.2
# Bins with less than this share of the typical weight have no row.
_LEAST_SHARE = 0.1
# Pointing along two axes, roll and focal length, which each field has for itself.
_OF_FIELD = 4.0


def field_residuals(
    result: FitResult, instrument: Instrument, *, bins: int | None = None
) -> pd.DataFrame:
    """Return the mean residual of each field less that of all others, in bins over the detectors.

    What all fields have in common, as distortion above the order, does not enter. Each mean is
    corrected for what the positions of the sources absorb, as in `mean_residuals`, and the whole
    for the pointing, roll and focal length of the field.

    Parameters
    ----------
    result : the fit
    instrument : of the fit; gives the outlines of the detectors
    bins : number of bins along the longer side of a detector; None for about 200 measurements
        of a field in each, from 2 to 5

    Returns
    -------
    A row per field and bin: `field_id`, `detector_id`, `x`, `y` (middle of the bin, mm on the
    focal plane), `n` (measurements of the field), and for x and y `difference_x_mpix`,
    `sigma_x_mpix` (expected by chance), `pull_x` (their ratio), `difference_x_mas`,
    `sigma_x_mas`; empty for a single field
    """
    found = focal_residuals(result, instrument)
    field_of = result.exposures["field_id"].to_numpy()[found.exposure]
    ids, number = np.unique(field_of, return_inverse=True)
    if bins is None:
        wanted = int(np.sqrt(len(found) / (len(ids) * _PER_BIN * len(instrument.detectors))))
        bins = min(max(wanted, _FEWEST_BINS), _MOST_BINS)
    grid, cells = square_bins(found, instrument, bins)
    sums, kept, n = _sums(found, number * len(grid) + cells, (len(ids), len(grid)))
    grid["x"] = grid[["left", "right"]].mean(axis=1)
    grid["y"] = grid[["bottom", "top"]].mean(axis=1)
    others = kept.sum(axis=0) - kept
    least = np.minimum(kept, others).min(axis=-1)
    typical = float(np.median(kept[kept > 0.0])) if (kept > 0.0).any() else 0.0
    is_known = (least > 0.0) & (least >= _LEAST_SHARE * typical)
    share = 1.0 - _OF_FIELD / np.maximum(2.0 * is_known.sum(axis=1), 1.0)
    tables = []
    for one in np.flatnonzero(share > 0.0):
        use = is_known[one]
        mine, theirs = (share[one] * of[one, use] for of in (kept, others))
        rest = sums.sum(axis=0)[use] - sums[one, use]
        table = grid.loc[use, ["detector_id", "x", "y"]].assign(n=n[one, use])
        table.insert(0, "field_id", ids[one])
        difference = sums[one, use] / mine - rest / theirs
        sigma = np.sqrt(1.0 / mine + 1.0 / theirs)
        for along, values, sigmas in zip("xy", difference.T, sigma.T, strict=True):
            table[f"difference_{along}_mpix"] = values
            table[f"sigma_{along}_mpix"] = sigmas
            table[f"pull_{along}"] = values / sigmas
            table[f"difference_{along}_mas"] = values * found.mas_per_mpix
            table[f"sigma_{along}_mas"] = sigmas * found.mas_per_mpix
        tables.append(table)
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def _sums(
    found: FocalResiduals, cells: np.ndarray, shape: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return sums of weighted residuals, the weights kept of them, and counts, by field and bin.

    Cells of which the positions of the sources leave little are empty.
    """
    size = shape[0] * shape[1]

    def summed(values: np.ndarray) -> np.ndarray:
        return np.stack([np.bincount(cells, of, minlength=size) for of in values.T], axis=-1)

    kept = found.kept_by_sources(cells, size)
    is_kept = kept > _LEAST_KEPT * summed(found.weight)
    sums = np.where(is_kept, summed(found.weight * found.vector), 0.0)
    n = np.bincount(cells, minlength=size).reshape(shape)
    return sums.reshape(*shape, 2), np.where(is_kept, kept, 0.0).reshape(*shape, 2), n


class FieldStatistics(NamedTuple):
    """Summary of the rows of one field of a table of `field_residuals`.

    Attributes
    ----------
    n : measurements of the field
    chi2, dof, scatter : sum of the squared pulls along both axes, and its mean and standard
        deviation by chance
    largest : largest difference along an axis over its sigma, absolute value
    limit : what the largest of so many exceeds in 1 % of fields by chance
    """

    n: int
    chi2: float
    dof: float
    scatter: float
    largest: float
    limit: float


def field_statistics(rows: pd.DataFrame) -> FieldStatistics:
    """Return the summary of the rows of one field, of which there are some."""
    pulls = rows[["pull_x", "pull_y"]].to_numpy()
    return FieldStatistics(
        n=int(rows["n"].sum()),
        chi2=float(np.sum(pulls**2)),
        dof=float(pulls.size),
        scatter=float(np.sqrt(2.0 * pulls.size)),
        largest=float(np.abs(pulls).max()),
        limit=largest_by_chance(pulls.size),
    )
