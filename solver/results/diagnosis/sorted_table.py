"""The table of residuals in the order of the exposures, and the columns that tests need of it."""

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import pandas as pd

from solver.data.result import FitResult


class SortedTable(NamedTuple):
    """The table of residuals, sorted by exposure, and in each exposure by detector.

    Attributes
    ----------
    stored : `schema.RESIDUALS`, as it is stored
    order : row of the stored table of each row, shape (n,)
    exposure, detector : of each row, indices into those of the result, shape (n,)
    """

    stored: pd.DataFrame
    order: np.ndarray
    exposure: np.ndarray
    detector: np.ndarray

    def column(self, name: str) -> np.ndarray:
        """Return a column, shape (n,)."""
        return self.stored[name].to_numpy().take(self.order)

    def pair(self, name: str) -> np.ndarray:
        """Return the columns of x and y whose names begin so, shape (n, 2); each is contiguous."""
        found = np.empty((2, len(self.order)))
        for axis, letter in zip(found, "xy", strict=True):
            values = self.stored[f"{name}{letter}"].to_numpy(dtype=float)
            np.take(values, self.order, out=axis, mode="clip")
        return found.T

    def source_index(self, ids: np.ndarray) -> np.ndarray:
        """Return the place of the source of each row among ascending ids, shape (n,)."""
        # Few ids are searched for: all of them would take ten times as long.
        source, known = pd.factorize(self.stored["source_id"].to_numpy())
        return np.searchsorted(ids, known).take(source).take(self.order)


class ResidualColumns(NamedTuple):
    """Columns of the sorted table.

    Attributes
    ----------
    source : index into the sources of the result, shape (n,)
    pixel : measured position, from the centre of the detector, pixels, shape (n, 2)
    focal : position on the focal plane, um, shape (n, 2)
    sigma : stated uncertainty, pixels, shape (n, 2)
    residual : measured minus predicted, pixels, shape (n, 2)
    """

    source: np.ndarray
    pixel: np.ndarray
    focal: np.ndarray
    sigma: np.ndarray
    residual: np.ndarray


def sorted_table(result: FitResult, n_det: int) -> SortedTable:
    """Return the table of residuals in the order of the exposures.

    Parameters
    ----------
    n_det : number of detectors
    """
    rotation = result.calibration["group"] == "detector_rotation"
    labels = result.calibration.loc[rotation, "label"].str.split().str[-1]
    ids = pd.Index(labels.to_numpy(dtype=np.int64))
    exposure, detector = result.exposure_index, ids.get_indexer(result.residuals["detector_id"])
    key = exposure * n_det + detector
    # Sixteen bits are sorted by their digits, ten times as fast as more.
    order = np.argsort(key.astype(np.min_scalar_type(key.max(initial=0))), kind="stable")
    return SortedTable(result.residuals, order, exposure.take(order), detector.take(order))


def read_columns(table: SortedTable, ids: np.ndarray) -> ResidualColumns:
    """Return the columns that are needed, read by two threads at once.

    Parameters
    ----------
    ids : of the sources of the result, ascending
    """
    with ThreadPoolExecutor(1) as thread:
        source = thread.submit(table.source_index, ids)
        pixel, focal = (thread.submit(table.pair, one) for one in ("n", "focal_"))
        sigma, residual = table.pair("s"), table.pair("residual_")
        return ResidualColumns(source.result(), pixel.result(), focal.result(), sigma, residual)
