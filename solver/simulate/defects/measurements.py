"""Defects of the table of measurements: outliers, and swapped and missing identifications."""

import numpy as np
import pandas as pd

from solver.data.defect_schema import AFFECTED
from solver.data.schema import EXPOSURE_KEY
from solver.simulate.defects.defect import Altered, AppliedDefect

# Errors of outliers in sigmas, log-uniform: from what looks like noise to a neighbour's light.
OUTLIER_SIGMAS = (5.0, 50.0)


def outliers(applied: AppliedDefect, table: pd.DataFrame) -> Altered:
    """Add errors of many sigmas, in random directions, to a share of the measurements."""
    rng = applied.orbit_rng()
    rows = _share(applied, table, rng)
    low, high = OUTLIER_SIGMAS
    sigmas = np.exp(rng.uniform(np.log(low), np.log(high), len(rows)))
    angle = rng.uniform(0.0, 2.0 * np.pi, len(rows))
    shift_x = sigmas * np.cos(angle) * table["sx"].to_numpy()[rows]
    shift_y = sigmas * np.sin(angle) * table["sy"].to_numpy()[rows]
    nx, ny = table["nx"].to_numpy().copy(), table["ny"].to_numpy().copy()
    nx[rows] += shift_x
    ny[rows] += shift_y
    affected = _affected(table.iloc[rows]).assign(shift_x=shift_x, shift_y=shift_y)
    return Altered(table.assign(nx=nx, ny=ny), affected)


def swapped(applied: AppliedDefect, table: pd.DataFrame) -> Altered:
    """Exchange the ids of a share of the measurements with their neighbours on the detector."""
    rng = applied.orbit_rng()
    group = table.groupby([*EXPOSURE_KEY, "detector_id"]).ngroup().to_numpy()
    order = np.argsort(group, kind="stable")
    starts = np.searchsorted(group[order], np.arange(group.max(initial=-1) + 2))
    place = table[["nx", "ny"]].to_numpy()
    source = table["source_id"].to_numpy().copy()
    is_free = np.ones(len(table), dtype=bool)
    wanted, changed = round(0.5 * applied.amplitude * len(table)), []
    for row in rng.permutation(len(table)):
        if len(changed) == wanted:
            break
        beside = order[starts[group[row]] : starts[group[row] + 1]]
        beside = beside[is_free[beside] & (beside != row)]
        if not is_free[row] or not len(beside):
            continue
        other = beside[np.argmin(np.sum((place[beside] - place[row]) ** 2, axis=1))]
        is_free[[row, other]] = False
        changed.append((row, other))
    rows = np.array(changed, dtype=int).reshape(-1, 2)
    source[rows] = source[rows[:, ::-1]]
    both = np.sort(rows.ravel())
    result = table.assign(source_id=source)
    truth = table["source_id"].to_numpy()[both]
    return Altered(result, _affected(result.iloc[both]).assign(true_source_id=truth))


def missing(applied: AppliedDefect, table: pd.DataFrame) -> Altered:
    """Leave a share of the measurements out."""
    rows = _share(applied, table, applied.orbit_rng())
    return Altered(table.drop(table.index[rows]), _affected(table.iloc[rows]))


def _share(applied: AppliedDefect, table: pd.DataFrame, rng: np.random.Generator) -> np.ndarray:
    """Return the row numbers of a random share of a table, sorted."""
    number = round(applied.amplitude * len(table))
    return np.sort(rng.permutation(len(table))[:number])


def _affected(rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows of the table of measurements as rows of `AFFECTED`."""
    ids = rows.assign(true_source_id=rows["source_id"], shift_x=np.nan, shift_y=np.nan)
    return ids[[name for name in AFFECTED.names if name != "defect"]]
