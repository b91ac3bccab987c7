"""SourceBlocks: sources that the same fields have seen.

What a source and an exposure have in common is zero where that has not seen it. So the
sources are put in an order in which those of one patch stand together, and what they have in
common with the calibration is a dense block in the columns of the exposures of its fields:
where an orbit has four fields, eliminating its sources takes a quarter of the products.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float, Int

from solver.model.forward import Index
from solver.problem.parameter_vector import PER_EXPOSURE, VectorLayout

# About so many columns are those of all exposures: the distortion of the paper's order, and the
# detectors. It decides on time alone.
OF_ALL = 60
# As many multiplications as take the time of handling one more block.
OF_ONE_BLOCK = 3e7
# Only so many sets of fields are told apart, the commonest.
MOST = 64


@dataclass(frozen=True)
class SourceBlock:
    """The places of some sources in the order of the blocks, and the columns they touch."""

    places: slice
    columns: Int[np.ndarray, " touched"]


@dataclass(frozen=True)
class SourceBlocks:
    """All sources of a problem in source_blocks.

    Attributes
    ----------
    order : the sources, patch after patch
    position : the place of each source in that order
    """

    order: Int[np.ndarray, " src"]
    position: Int[np.ndarray, " src"]
    blocks: tuple[SourceBlock, ...]

    def chains(self) -> list[list[int]]:
        """Return the numbers of the source_blocks, in chains.

        The columns of each patch are among those of the one before it.
        """
        chains: list[list[int]] = []
        for number in sorted(range(len(self.blocks)), key=lambda n: -len(self.blocks[n].columns)):
            columns = self.blocks[number].columns
            for chain in chains:
                if np.isin(columns, self.blocks[chain[-1]].columns).all():
                    chain.append(number)
                    break
            else:
                chains.append([number])
        return chains

    def last(self, chain: list[int], size: int) -> Int[np.ndarray, " calib"]:
        """Return all columns in an order in which those of every patch of a chain stand last."""
        rank = np.zeros(size, dtype=np.int64)
        for number in chain:
            rank[self.blocks[number].columns] += 1
        return np.argsort(rank, kind="stable")


@dataclass(frozen=True)
class FieldSets:
    """Sources by the set of fields that has seen them, whatever parameters there are.

    Attributes
    ----------
    order : the sources, set after set
    position : the place of each source in that order
    places : of the sources of each set
    exposures : those of its fields
    """

    order: Int[np.ndarray, " src"]
    position: Int[np.ndarray, " src"]
    places: tuple[slice, ...]
    exposures: Bool[np.ndarray, "set exp"]

    def touching(self, layout: VectorLayout) -> SourceBlocks:
        """Return each set as a patch, with the columns that it touches."""
        blocks = zip(self.places, self.exposures, strict=True)
        return SourceBlocks(
            self.order,
            self.position,
            tuple(SourceBlock(places, _touched(exposures, layout)) for places, exposures in blocks),
        )


def field_sets(index: Index, exposures: pd.DataFrame, n_src: int) -> FieldSets:
    """Tell the sources apart by the fields that have seen them, as far as that saves time.

    Parameters
    ----------
    index : of the measurements, one after the other
    exposures : with the `field_id` of each
    """
    field_ids, field = np.unique(exposures["field_id"].to_numpy(), return_inverse=True)
    seen = np.zeros((n_src, len(field_ids)), dtype=bool)
    seen[index.source, field[index.exposure]] = True
    of_fields = len(PER_EXPOSURE) * np.bincount(field, minlength=len(field_ids))
    which, by_fields = _joined(*_told_apart(seen), of_fields.astype(np.float64))
    order = np.argsort(which, kind="stable")
    position = np.empty(n_src, dtype=np.int64)
    position[order] = np.arange(n_src)
    bounds = np.cumsum([0, *np.bincount(which, minlength=len(by_fields))]).tolist()
    places = tuple(map(slice, bounds[:-1], bounds[1:]))
    return FieldSets(order, position, places, by_fields[:, field])


def _told_apart(
    seen: Bool[np.ndarray, "src field"],
) -> tuple[Int[np.ndarray, " src"], Bool[np.ndarray, "patch field"]]:
    """Return the patch of each source, and the fields of each patch: one for every set."""
    by_fields, which = np.unique(seen, axis=0, return_inverse=True)
    which = which.reshape(-1)
    if len(by_fields) <= MOST:
        return which, by_fields
    # All others make one patch, that any field may have seen.
    commonest = np.argsort(-np.bincount(which), kind="stable")[: MOST - 1]
    number = np.full(len(by_fields), MOST - 1)
    number[commonest] = np.arange(MOST - 1)
    everywhere = np.ones((1, by_fields.shape[1]), dtype=bool)
    return number[which], np.concatenate([by_fields[commonest], everywhere])


def _joined(
    which: Int[np.ndarray, " src"],
    by_fields: Bool[np.ndarray, "patch field"],
    of_fields: Float[np.ndarray, " field"],
) -> tuple[Int[np.ndarray, " src"], Bool[np.ndarray, "fewer field"]]:
    """Join patches as long as that saves time, first the two that save most.

    Parameters
    ----------
    of_fields : the number of columns that are of exposures of each field
    """

    def width(by_fields: Bool[np.ndarray, "*n field"]) -> Float[np.ndarray, "*n"]:
        return OF_ALL + by_fields @ of_fields

    while len(by_fields) > 1:
        count = np.bincount(which, minlength=len(by_fields))
        both = by_fields[:, None] | by_fields
        alone = count * width(by_fields) ** 2 + OF_ONE_BLOCK
        together = (count[:, None] + count) * width(both) ** 2 + OF_ONE_BLOCK
        saved = alone[:, None] + alone - together
        np.fill_diagonal(saved, -np.inf)
        kept, gone = sorted(np.unravel_index(saved.argmax(), saved.shape))
        if saved[kept, gone] <= 0.0:
            break
        by_fields[kept] = both[kept, gone]
        by_fields = np.delete(by_fields, gone, axis=0)
        which = np.where(which == gone, kept, which - (which > gone))
    return which, by_fields


def _touched(
    exposures: Bool[np.ndarray, " exp"], layout: VectorLayout
) -> Int[np.ndarray, " touched"]:
    """Return the columns of some exposures, and those that are no exposure's."""
    touched = np.ones(layout.size, dtype=bool)
    for group in PER_EXPOSURE:
        touched[layout.columns(group)] = exposures
    return np.flatnonzero(touched)
