"""SourceBlocks: sources grouped by the fields that observed them.

The cross block between a source and an exposure is zero if the exposure did not observe the
source. Sources are ordered such that those of one source block are contiguous; their cross block
with the calibration is then dense in the columns of the exposures of the block's fields. For an
orbit of four fields, eliminating the sources takes a quarter of the multiplications.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float, Int

from solver.model.forward import Index
from solver.problem.parameter_vector import PER_EXPOSURE, VectorLayout

# Approximate number of columns that all source blocks share: the distortion of the paper's order
# and the detectors. Used only to estimate computing time.
SHARED_COLUMNS = 60
# Cost of one more block, in multiplications.
BLOCK_OVERHEAD = 3e7
# Maximum number of blocks before merging; the commonest sets of fields have one each.
MAX_BLOCKS = 64


@dataclass(frozen=True)
class SourceBlock:
    """The places of its sources in block order, and the columns they depend on."""

    places: slice
    columns: Int[np.ndarray, " touched"]


@dataclass(frozen=True)
class SourceBlocks:
    """All source blocks of a problem.

    Attributes
    ----------
    order : the sources in block order, that is block after block
    position : the place of each source in that order
    """

    order: Int[np.ndarray, " src"]
    position: Int[np.ndarray, " src"]
    blocks: tuple[SourceBlock, ...]


@dataclass(frozen=True)
class FieldSets:
    """Sources grouped by the set of fields that observed them, for any parameters.

    Attributes
    ----------
    order : the sources, set after set
    position : the place of each source in that order
    places : the places of the sources of each set in that order
    exposures : whether each exposure is of one of the set's fields
    """

    order: Int[np.ndarray, " src"]
    position: Int[np.ndarray, " src"]
    places: tuple[slice, ...]
    exposures: Bool[np.ndarray, "set exp"]

    def touching(self, layout: VectorLayout) -> SourceBlocks:
        """Return each set as a source block, with the columns that it depends on."""
        sets = zip(self.places, self.exposures, strict=True)
        return SourceBlocks(
            self.order,
            self.position,
            tuple(SourceBlock(place, _columns_of(exposures, layout)) for place, exposures in sets),
        )


def field_sets(index: Index, exposures: pd.DataFrame, n_src: int) -> FieldSets:
    """Group the sources by the fields that observed them, and merge groups where that saves time.

    Parameters
    ----------
    index : of the measurements
    exposures : with the column `field_id`
    """
    field_ids, field = np.unique(exposures["field_id"].to_numpy(), return_inverse=True)
    seen = np.zeros((n_src, len(field_ids)), dtype=bool)
    seen[index.source, field[index.exposure]] = True
    columns_of_field = len(PER_EXPOSURE) * np.bincount(field, minlength=len(field_ids))
    block_of_source, fields_of_block = _merged(
        *_by_field_set(seen), columns_of_field.astype(np.float64)
    )
    order = np.argsort(block_of_source, kind="stable")
    position = np.empty(n_src, dtype=np.int64)
    position[order] = np.arange(n_src)
    bounds = np.cumsum([0, *np.bincount(block_of_source, minlength=len(fields_of_block))]).tolist()
    places = tuple(map(slice, bounds[:-1], bounds[1:]))
    return FieldSets(order, position, places, fields_of_block[:, field])


def _by_field_set(
    seen: Bool[np.ndarray, "src field"],
) -> tuple[Int[np.ndarray, " src"], Bool[np.ndarray, "block field"]]:
    """Return the block of each source and the fields of each block, one block per field set."""
    fields_of_block, block_of_source = np.unique(seen, axis=0, return_inverse=True)
    block_of_source = block_of_source.reshape(-1)
    if len(fields_of_block) <= MAX_BLOCKS:
        return block_of_source, fields_of_block
    # The other sources form one block, with all fields.
    commonest = np.argsort(-np.bincount(block_of_source), kind="stable")[: MAX_BLOCKS - 1]
    number = np.full(len(fields_of_block), MAX_BLOCKS - 1)
    number[commonest] = np.arange(MAX_BLOCKS - 1)
    everywhere = np.ones((1, fields_of_block.shape[1]), dtype=bool)
    return number[block_of_source], np.concatenate([fields_of_block[commonest], everywhere])


def _merged(
    block_of_source: Int[np.ndarray, " src"],
    fields_of_block: Bool[np.ndarray, "block field"],
    columns_of_field: Float[np.ndarray, " field"],
) -> tuple[Int[np.ndarray, " src"], Bool[np.ndarray, "fewer field"]]:
    """Merge pairs of blocks while that saves time, the pair that saves most first.

    Parameters
    ----------
    columns_of_field : number of columns of the exposures of each field
    """

    def width(fields_of_block: Bool[np.ndarray, "*n field"]) -> Float[np.ndarray, "*n"]:
        return SHARED_COLUMNS + fields_of_block @ columns_of_field

    while len(fields_of_block) > 1:
        count = np.bincount(block_of_source, minlength=len(fields_of_block))
        both = fields_of_block[:, None] | fields_of_block
        alone = count * width(fields_of_block) ** 2 + BLOCK_OVERHEAD
        together = (count[:, None] + count) * width(both) ** 2 + BLOCK_OVERHEAD
        saved = alone[:, None] + alone - together
        np.fill_diagonal(saved, -np.inf)
        kept, merged = sorted(np.unravel_index(saved.argmax(), saved.shape))
        if saved[kept, merged] <= 0.0:
            break
        fields_of_block[kept] = both[kept, merged]
        fields_of_block = np.delete(fields_of_block, merged, axis=0)
        block_of_source = np.where(
            block_of_source == merged, kept, block_of_source - (block_of_source > merged)
        )
    return block_of_source, fields_of_block


def _columns_of(
    exposures: Bool[np.ndarray, " exp"], layout: VectorLayout
) -> Int[np.ndarray, " touched"]:
    """Return the columns of the given exposures, and those that belong to no exposure."""
    is_touched = np.ones(layout.size, dtype=bool)
    for group in layout.on("exp"):
        is_touched[layout.columns(group)] = exposures
    is_touched[layout.walked(np.arange(len(exposures)))] = exposures[:, None]
    return np.flatnonzero(is_touched)
