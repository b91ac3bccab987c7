"""Measurements: the measurements of one orbit as arrays, in working order.

Working order is by exposure, detector and source, so that measurements which depend on the
same calibration parameters are contiguous. No setting enters, so all problems of the same
measurements share the arrays derived from them.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float, Int

from solver.data.instrument import Instrument
from solver.model.forward import Index
from solver.problem.source_blocks import FieldSets, field_sets
from solver.problem.tiles import Gathering, Tiles, lay_tiles

KEY = ["field_id", "plate_id"]


@dataclass(frozen=True)
class Measurements:
    """The measurements of an orbit.

    Attributes
    ----------
    index : source, exposure and detector of each measurement
    measured : pixels from the detector's centre
    sigma : pixels
    row : row of each measurement in the input table
    label : index label of that row, which stays when other rows are removed from the table
    n_det : number of detectors of the instrument, with or without measurements
    sets : the sources grouped by the fields that observed them
    """

    index: Index
    measured: Float[np.ndarray, "obs 2"]
    sigma: Float[np.ndarray, "obs 2"]
    row: Int[np.ndarray, " obs"]
    label: Int[np.ndarray, " obs"]
    n_det: int
    sets: FieldSets

    @cached_property
    def tiles(self) -> Tiles:
        """The measurements in tiles."""
        return lay_tiles(self.index, self.measured, self.sigma)

    @cached_property
    def by_source(self) -> Gathering:
        """How to sum a 2 x 2 matrix of each slot by detector and source, in block order."""
        return self.tiles.by_source(self.sets.position, self.n_det, 4)

    def of_rows(self, chosen: Bool[np.ndarray, " obs"]) -> "Measurements":
        """Return a subset of the measurements, with all sources."""
        return replace(
            self,
            index=Index(*(column[chosen] for column in self.index)),
            measured=self.measured[chosen],
            sigma=self.sigma[chosen],
            row=self.row[chosen],
            label=self.label[chosen],
        )

    def remaining(self, kept: Bool[np.ndarray, " row"], exposures: pd.DataFrame) -> "Remaining":
        """Return what is left when rows of the input table are removed.

        Parameters
        ----------
        kept : whether each row of the table is kept
        exposures : all exposures, in ascending order of `KEY`
        """
        subset = self.of_rows(kept[self.row])
        with_source = np.bincount(subset.index.source, minlength=len(self.sets.order)) > 0
        with_exposure = np.bincount(subset.index.exposure, minlength=len(exposures)) > 0
        exposures = exposures[with_exposure].reset_index(drop=True)
        index = Index(
            _renumbered(with_source)[subset.index.source],
            _renumbered(with_exposure)[subset.index.exposure],
            subset.index.detector,
        )
        sets = field_sets(index, exposures, int(with_source.sum()))
        row = _renumbered(kept)[subset.row]
        return Remaining(replace(subset, index=index, row=row, sets=sets), with_source, exposures)

    def of_sources(self, keep: Bool[np.ndarray, " src"], exposures: pd.DataFrame) -> "Measurements":
        """Return the measurements of a subset of the sources, with these sources only."""
        subset = self.of_rows(keep[self.index.source])
        index = subset.index._replace(source=_renumbered(keep)[subset.index.source])
        return replace(subset, index=index, sets=field_sets(index, exposures, int(keep.sum())))


class Remaining(NamedTuple):
    """Some measurements of an orbit; which sources they are of, and their exposures."""

    measurements: Measurements
    with_source: Bool[np.ndarray, " src"]
    exposures: pd.DataFrame


def _renumbered(kept: Bool[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    """Return the number of each kept element among those that are kept."""
    return np.cumsum(kept) - 1


def sort_measurements(
    measurements: pd.DataFrame,
    exposures: pd.DataFrame,
    source_ids: Int[np.ndarray, " src"],
    instrument: Instrument,
) -> Measurements:
    """Sort a table of measurements into working order.

    Parameters
    ----------
    exposures : in ascending order of `KEY`
    source_ids : IDs of all measured sources, ascending

    Raises
    ------
    InputError
        If a detector is not part of the instrument.
    """
    source = np.searchsorted(source_ids, measurements["source_id"].to_numpy())
    keys = pd.MultiIndex.from_frame(exposures[KEY])
    exposure = keys.get_indexer(pd.MultiIndex.from_frame(measurements[KEY]))
    detector = instrument.index_of(measurements["detector_id"].to_numpy())
    row = np.lexsort((source, detector, exposure))
    index = Index(source[row], exposure[row], detector[row])
    table = measurements.iloc[row]
    return Measurements(
        index=index,
        measured=table[["nx", "ny"]].to_numpy(),
        sigma=table[["sx", "sy"]].to_numpy(),
        row=row,
        label=table.index.to_numpy(),
        n_det=len(instrument.detectors),
        sets=field_sets(index, exposures, len(source_ids)),
    )
