"""Patches: sources that the same fields have seen.

What a source and an exposure have in common is zero where that has not seen it. So the
sources are put in an order in which those of one patch stand together, and what they have in
common with the calibration is a dense block in the columns of the exposures of its fields:
where an orbit has four fields, eliminating its sources takes a quarter of the products.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float, Int

from solver.forward import Index
from solver.layout import PER_EXPOSURE, Layout

# As many multiplications as take the time of handling one more block.
OF_ONE_BLOCK = 3e7
# Only so many sets of fields are told apart, the commonest.
MOST = 64


@dataclass(frozen=True)
class Patch:
    """Some sources, by their places in the order of the patches, and the columns they touch."""

    places: slice
    columns: Int[np.ndarray, " touched"]


@dataclass(frozen=True)
class Patches:
    """All sources of a problem in patches.

    Attributes
    ----------
    order : the sources, patch after patch
    position : the place of each source in that order
    """

    order: Int[np.ndarray, " src"]
    position: Int[np.ndarray, " src"]
    parts: tuple[Patch, ...]


def patches_of(index: Index, exposures: pd.DataFrame, layout: Layout, n_src: int) -> Patches:
    """Put the sources in patches.

    Parameters
    ----------
    index : of the measurements, one after the other
    exposures : with the `field_id` of each
    """
    field_ids, field = np.unique(exposures["field_id"].to_numpy(), return_inverse=True)
    n_fields = len(field_ids)
    seen = np.zeros((n_src, n_fields), dtype=bool)
    seen[index.source, field[index.exposure]] = True
    of_fields = len(PER_EXPOSURE) * np.bincount(field, minlength=n_fields)
    shared = layout.size - len(PER_EXPOSURE) * layout.n_exp

    def width(by_fields: Bool[np.ndarray, "*n field"]) -> Float[np.ndarray, "*n"]:
        return shared + by_fields @ of_fields.astype(np.float64)

    which, by_fields = _joined(*_told_apart(seen), width)
    order = np.argsort(which, kind="stable")
    position = np.empty(n_src, dtype=np.int64)
    position[order] = np.arange(n_src)
    bounds = np.cumsum([0, *np.bincount(which, minlength=len(by_fields))]).tolist()
    parts = zip(bounds[:-1], bounds[1:], by_fields, strict=True)
    return Patches(
        order,
        position,
        tuple(Patch(slice(i, j), _touched(fields[field], layout)) for i, j, fields in parts),
    )


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
    width: Callable[[Bool[np.ndarray, "*n field"]], Float[np.ndarray, "*n"]],
) -> tuple[Int[np.ndarray, " src"], Bool[np.ndarray, "fewer field"]]:
    """Join patches as long as that saves time, first the two that save most.

    Parameters
    ----------
    width : the number of columns that some fields touch
    """
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


def _touched(exposures: Bool[np.ndarray, " exp"], layout: Layout) -> Int[np.ndarray, " touched"]:
    """Return the columns of some exposures, and those that are no exposure's."""
    touched = np.ones(layout.size, dtype=bool)
    for group in PER_EXPOSURE:
        touched[layout.columns(group)] = exposures
    return np.flatnonzero(touched)
