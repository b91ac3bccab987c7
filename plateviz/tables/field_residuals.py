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
    places = pd.DataFrame(
        {
            "detector_id": grid["detector_id"],
            "x": grid[["left", "right"]].mean(axis=1),
            "y": grid[["bottom", "top"]].mean(axis=1),
        }
    )
    sums = _sums(found, number * len(grid) + cells, (len(ids), len(grid)))
    is_known = sums.are_known()
    share = 1.0 - _OF_FIELD / np.maximum(2.0 * is_known.sum(axis=1), 1.0)
    tables = []
    for one in map(int, np.flatnonzero(share > 0.0)):
        use = is_known[one]
        table = places[use].assign(n=sums.n[one, use])
        table.insert(0, "field_id", ids[one])
        difference, sigma = sums.difference(one, use, share[one])
        tables.append(table.assign(**_columns(difference, sigma, found.mas_per_mpix)))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


class _Sums(NamedTuple):
    """Sums over the measurements of each field in each bin.

    Attributes
    ----------
    weighted : of the weighted residuals, mpix^-1, shape (fields, bins, 2)
    kept : of the weights, less what the positions of the sources absorb, mpix^-2, the same shape
    n : number of measurements, shape (fields, bins)
    """

    weighted: np.ndarray
    kept: np.ndarray
    n: np.ndarray

    @property
    def _kept_of_others(self) -> np.ndarray:
        """What `kept` is of all other fields together."""
        return self.kept.sum(axis=0) - self.kept

    def are_known(self) -> np.ndarray:
        """Return in which bins a field can be compared with the others, shape (fields, bins)."""
        least = np.minimum(self.kept, self._kept_of_others).min(axis=-1)
        is_filled = self.kept > 0.0
        typical = float(np.median(self.kept[is_filled])) if is_filled.any() else 0.0
        return (least > 0.0) & (least >= _LEAST_SHARE * typical)

    def difference(
        self, field: int, bins: np.ndarray, share: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean of a field less that of the others in some bins, and its sigma.

        Parameters
        ----------
        field : index of the field
        bins : whether to use each bin, shape (bins,)
        share : what the pointing, roll and focal length of the field leave of the difference

        Returns
        -------
        Two arrays of shape (used bins, 2), mpix
        """
        mine, theirs = (share * of[field, bins] for of in (self.kept, self._kept_of_others))
        rest = self.weighted.sum(axis=0)[bins] - self.weighted[field, bins]
        difference = self.weighted[field, bins] / mine - rest / theirs
        return difference, np.sqrt(1.0 / mine + 1.0 / theirs)


def _sums(found: FocalResiduals, cells: np.ndarray, shape: tuple[int, int]) -> _Sums:
    """Return the sums by field and bin; cells of which the sources leave little are empty.

    Parameters
    ----------
    cells : of each measurement: that of its field and bin in an array of `shape`, flattened
    shape : number of fields and of bins
    """
    size = shape[0] * shape[1]

    def summed(values: np.ndarray) -> np.ndarray:
        return np.stack([np.bincount(cells, of, minlength=size) for of in values.T], axis=-1)

    kept = found.kept_by_sources(cells, size)
    is_kept = kept > _LEAST_KEPT * summed(found.weight)
    weighted = np.where(is_kept, summed(found.weight * found.vector), 0.0)
    return _Sums(
        weighted.reshape(*shape, 2),
        np.where(is_kept, kept, 0.0).reshape(*shape, 2),
        np.bincount(cells, minlength=size).reshape(shape),
    )


def _columns(
    difference: np.ndarray, sigma: np.ndarray, mas_per_mpix: float
) -> dict[str, np.ndarray]:
    """Return the columns of differences and their sigmas, both of shape (rows, 2), in mpix."""
    columns = {}
    for along, values, sigmas in zip("xy", difference.T, sigma.T, strict=True):
        columns |= {
            f"difference_{along}_mpix": values,
            f"sigma_{along}_mpix": sigmas,
            f"pull_{along}": values / sigmas,
            f"difference_{along}_mas": values * mas_per_mpix,
            f"sigma_{along}_mas": sigmas * mas_per_mpix,
        }
    return columns


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
