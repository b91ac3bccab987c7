"""Test of the identifications: measurements that are where each other should be."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from solver.data.result import FitResult
from solver.results.diagnosis.outliers import FAR
from solver.results.diagnosis.rate import log_chance_poisson
from solver.results.diagnosis.rows import Rows

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


def swapped(result: FitResult, rows: Rows) -> Swapped:
    """Return the measurements far off that are where another one far off should be, and it there.

    It holds in a solution that such measurements keep from converging, as long as most stars are
    near their places.

    Parameters
    ----------
    rows : with all exposures
    """
    table, far = result.residuals, rows.chi2 > FAR**2
    chosen, chi2 = rows.stored[far], rows.chi2[far]
    residual, at = (
        np.stack([table[f"{name}{axis}"].to_numpy(dtype=float)[chosen] for axis in "xy"], axis=1)
        for name in ("residual_", "n")
    )
    area = float(np.prod([np.ptp(along) for along in rows.pixel.T])) if rows.n else 0.0
    distance = np.hypot(*residual.T)
    share = np.pi * (_NEAR * distance) ** 2 / max(area, 1e-300)
    pairs, expected = [], 0.0
    of_run = np.searchsorted(rows.runs, np.flatnonzero(far), side="right")
    for near in np.split(np.arange(len(chosen)), 1 + np.flatnonzero(np.diff(of_run))):
        if len(near) < 2:
            continue
        a, b = _pairs(at[near], at[near] - residual[near], _NEAR * distance[near])
        pairs += [chosen[np.stack([near[a], near[b]], axis=1).ravel()]]
        # Each is there by chance.
        expected += 0.5 * float(np.minimum(share[near], 1.0).sum()) ** 2
    found = np.concatenate([np.empty(0, dtype=np.int64), *pairs])
    chance = log_chance_poisson(len(found) // 2, expected)
    sources = tuple(np.unique(table["source_id"].to_numpy()[found]).tolist())
    return Swapped(found, sources, expected, chance, float(chi2[np.isin(chosen, found)].sum()))


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
