"""The places of ids among known ones."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

# Entries of a table of all ids that there could be.
_LARGEST_TABLE = 1 << 16


def places_among(known: Sequence[np.ndarray], values: Sequence[np.ndarray]) -> np.ndarray:
    """Return the place of each value among distinct known ones, shape (n,); each is one of them.

    Ids near each other, as those of detectors and exposures are, need no search: a table of them is
    several times as fast as a hash.

    Parameters
    ----------
    known : columns of whole numbers, which together are the ids, each of shape (k,)
    values : the same columns, each of shape (n,)
    """
    if not len(known[0]):
        return np.empty(0, dtype=np.intp)
    if np.prod([np.ptp(column) + 1.0 for column in known]) > _LARGEST_TABLE:
        pairs = [np.concatenate(pair) for pair in zip(known, values, strict=True)]
        numbers = [pd.factorize(pair)[0] for pair in pairs]
        known, values = zip(*(np.split(one, [len(known[0])]) for one in numbers), strict=True)
    low = [int(column.min()) for column in known]
    spans = [int(np.ptp(column)) + 1 for column in known]
    of_known, of_values = (
        np.ravel_multi_index([one - least for one, least in zip(ids, low, strict=True)], spans)
        for ids in (known, values)
    )
    table = np.empty(int(np.prod(spans)), dtype=np.intp)
    table[of_known] = np.arange(len(of_known))
    return table.take(of_values)
