"""Spans: exposures among which no detector moves, where a fit lets detectors move.

A field is one span, and two or more where a detector was found to move within it.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Int

# Of the exposures: how often a detector has moved within the field until then.
MOVES = "moves_in_field"


class Move(NamedTuple):
    """A move of a detector within a field.

    Attributes
    ----------
    field_id, plate_id : of the first exposure after it
    obstime : of that exposure, MJD in TCB
    """

    field_id: int
    plate_id: int
    obstime: float


def with_moves(exposures: pd.DataFrame, moves: Iterable[Move]) -> pd.DataFrame:
    """Return exposures with the column `MOVES`.

    The time of a move decides: the exposure that it names may have been left out.
    """
    count = np.zeros(len(exposures), dtype=np.int64)
    for move in moves:
        in_field = exposures["field_id"] == move.field_id
        count += (in_field & (exposures["obstime"] >= move.obstime)).to_numpy()
    return exposures.assign(**{MOVES: count})


def span_numbers(exposures: pd.DataFrame) -> Int[np.ndarray, " exp"]:
    """Return the number of the span of each exposure, from 0, in order of the fields."""
    names = ["field_id", MOVES] if MOVES in exposures else ["field_id"]
    keys = np.stack([exposures[name].to_numpy() for name in names], axis=1)
    return np.unique(keys, axis=0, return_inverse=True)[1].ravel()


def motion_elements(
    spans: Int[np.ndarray, " exp"],
    exposure: Int[np.ndarray, "*#n"],
    detector: Int[np.ndarray, "*#n"],
) -> Int[np.ndarray, "*n"]:
    """Return the element of the axis `motion` of exposures and detectors.

    The elements of a detector are adjacent, one per span after the first. Nothing moves in the
    first span; its exposures are given the element of the second.

    Parameters
    ----------
    spans : number of the span of each exposure
    exposure, detector : indices, broadcast against each other
    """
    n_moved = max(int(spans.max(initial=0)), 1)
    return n_moved * detector + np.maximum(spans[exposure] - 1, 0)
