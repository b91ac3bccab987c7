"""The table of residuals in the order of the exposures, and the columns that tests need of it."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from solver.data.places import places_among
from solver.data.result import FitResult


class SortedTable(NamedTuple):
    """The table of residuals, sorted by exposure, and in each exposure by detector.

    Attributes
    ----------
    stored : `schema.RESIDUALS`, as it is stored
    order : row of the stored table of each row, shape (n,)
    exposure, detector : of each row, indices into those of the result, shape (n,)
    runs : row of the first measurement of each exposure on each of its detectors, shape (runs,)
    """

    stored: pd.DataFrame
    order: np.ndarray
    exposure: np.ndarray
    detector: np.ndarray
    runs: np.ndarray

    def column(self, name: str) -> np.ndarray:
        """Return a column, shape (n,)."""
        return self._in_order(name, np.empty(len(self.order)))

    def of_detectors(self, values: np.ndarray) -> np.ndarray:
        """Return at each row what is of its detector, shape (..., n), from (..., detectors)."""
        return over_runs(values.take(self.detector[self.runs], axis=-1), self.runs, len(self.order))

    def pair(self, name: str) -> np.ndarray:
        """Return the columns of x and y whose names begin so, shape (n, 2); each is contiguous."""
        found = np.empty((2, len(self.order)))
        for axis, letter in zip(found, "xy", strict=True):
            self._in_order(f"{name}{letter}", axis)
        return found.T

    def _in_order(self, name: str, out: np.ndarray) -> np.ndarray:
        # Seven digits are plenty, and half as much memory is read at random in half the time.
        single = self.stored[name].to_numpy(dtype=np.float32)
        out[:] = single.take(self.order, mode="clip")
        return out


def sorted_table(result: FitResult, n_det: int) -> SortedTable:
    """Return the table of residuals in the order of the exposures.

    Parameters
    ----------
    n_det : number of detectors
    """
    labels = result.values_of("detector_rotation", "label")
    detectors = np.array([int(label.split()[-1]) for label in labels])
    n_exp, names = len(result.exposures), ("field_id", "plate_id")
    known = [np.repeat(result.exposures[name].to_numpy(), n_det) for name in names]
    of_rows = [result.residuals[name].to_numpy() for name in (*names, "detector_id")]
    key = places_among([*known, np.tile(detectors, n_exp)], of_rows)
    counts = np.bincount(key, minlength=n_exp * n_det)
    # Sixteen bits are sorted by their digits, ten times as fast as more.
    order = np.argsort(key.astype(np.min_scalar_type(len(counts))), kind="stable")
    exposure, detector = (
        np.repeat(number, counts) for number in np.divmod(np.arange(len(counts)), n_det)
    )
    runs = (np.cumsum(counts) - counts)[counts > 0]
    return SortedTable(result.residuals, order, exposure, detector, runs)


def runs_of(exposure: np.ndarray, detector: np.ndarray) -> np.ndarray:
    """Return the first row of each exposure on each of its detectors, of sorted rows."""
    is_first = np.ones(len(exposure), dtype=bool)
    np.not_equal(detector[1:], detector[:-1], out=is_first[1:])
    is_first[1:] |= exposure[1:] != exposure[:-1]
    return np.flatnonzero(is_first)


def over_runs(values: np.ndarray, runs: np.ndarray, n: int) -> np.ndarray:
    """Return at each of `n` rows what is of its run, shape (..., n), from (..., runs)."""
    return np.repeat(values, np.diff(runs, append=n), axis=-1)


def places_of_sources(result: FitResult) -> np.ndarray:
    """Return the place of the source of each residual, as it is stored, among those of the result.

    Shape (n,).
    """
    return pd.Index(result.sources["source_id"]).get_indexer(result.residuals["source_id"])
