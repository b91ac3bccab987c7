"""Test of the identifications: measurements that are where each other should be."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from solver.data.result import FitResult
from solver.results.diagnosis.rate import log_chance_poisson
from solver.results.diagnosis.rows import FAR

# Of its own residual: how near one has to be to where the other should be. The positions of
# both stars are off, too, by the share that one wrong measurement has in them.
_NEAR = 0.25


class Swapped(NamedTuple):
    """Pairs of measurements with each other's identification.

    Attributes
    ----------
    rows : of the residual table, those of a pair one after the other
    items : ids of their sources
    expected : number of pairs by chance
    log_chance : logarithm of the probability of as many by chance
    chi2 : sum over the rows
    """

    rows: np.ndarray
    items: tuple[int, ...]
    expected: float
    log_chance: float
    chi2: float


def swapped(result: FitResult) -> Swapped:
    """Return the measurements far off that are where another one far off should be, and it there.

    It holds in a solution that such measurements keep from converging, as long as most stars are
    near their places.
    """
    table = result.residuals
    axes = [
        [table[f"{name}{axis}"].to_numpy(dtype=float) for name in ("residual_", "s", "n")]
        for axis in "xy"
    ]
    chi2 = np.sum([np.square(residual / sigma) for residual, sigma, _ in axes], axis=0)
    chosen = np.flatnonzero(chi2 > FAR**2)
    residual, at = (np.stack([axis[k][chosen] for axis in axes], axis=1) for k in (0, 2))
    area = float(np.prod([np.ptp(of_all) for *_, of_all in axes]))
    distance = np.hypot(*residual.T)
    share = np.pi * (_NEAR * distance) ** 2 / max(area, 1e-300)
    pairs, expected = [], 0.0
    keys = [result.exposure_index[chosen], table["detector_id"].to_numpy()[chosen]]
    for rows in pd.Series(chosen).groupby(keys).indices.values():
        if len(rows) < 2:
            continue
        a, b = _pairs(at[rows], at[rows] - residual[rows], _NEAR * distance[rows])
        pairs += [chosen[np.stack([rows[a], rows[b]], axis=1).ravel()]]
        # Each is there by chance.
        expected += 0.5 * float(np.minimum(share[rows], 1.0).sum()) ** 2
    found = np.concatenate([np.empty(0, dtype=np.int64), *pairs])
    chance = log_chance_poisson(len(found) // 2, expected)
    sources = tuple(np.unique(table["source_id"].to_numpy()[found]).tolist())
    return Swapped(found, sources, expected, chance, float(chi2[np.unique(found)].sum()))


def _pairs(
    measured: np.ndarray, model: np.ndarray, near: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows that are each near where the other should be, in ascending order."""
    # Trees round distances in another way than the comparison below.
    found = cKDTree(model).query_ball_point(measured, near * (1.0 + 1e-9), return_sorted=True)
    a = np.repeat(np.arange(len(found)), [len(one) for one in found])
    b = np.concatenate(found).astype(np.int64)
    is_there = np.hypot(*(measured[a] - model[b]).T) < np.minimum(near[a], near[b])
    there = set(zip(a[is_there].tolist(), b[is_there].tolist(), strict=True))
    pairs = sorted((i, j) for i, j in there if i < j and (j, i) in there)
    first, second = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    return first, second
