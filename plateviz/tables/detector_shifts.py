"""Table of the shift of each detector in the course of an orbit, and its summary."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from plateviz.tables.chance import largest_by_chance
from plateviz.tables.exposures import minutes_since_first
from plateviz.tables.focal_residuals import FocalResiduals, focal_residuals
from plateviz.tables.labels import exposure_labels
from solver.data.instrument import Instrument
from solver.data.result import FitResult

# A shift of which less is left in the residuals has no row: that of a single detector.
_LEAST_SHARE = 0.02
_BAND_SIGMAS = 2.0

# Displacements of the measurements along x and y of the focal plane, each of shape (n,).
_Move = tuple[np.ndarray, np.ndarray]


def detector_shifts(
    result: FitResult, instrument: Instrument, *, together: Sequence[int] = (1, 6)
) -> pd.DataFrame:
    """Return the shift of each detector over time, against its fitted place.

    The fit has one place of a detector for the whole orbit. If the detector moves, its mean
    residual changes, but by less than the detector: pointing, roll and focal length of the
    exposure absorb a share, and the positions of its sources another. The shift is the mean
    residual over the share that is left, so that it is the move of a detector that moves alone;
    its sigma is that of the mean over the same share. What the mean over the orbit absorbs is
    neglected.

    Parameters
    ----------
    result : the fit
    instrument : of the fit; gives the order of the detectors
    together : numbers of successive exposures of a field whose mean is a row

    Returns
    -------
    A row per number of `together`, group of as many exposures, and detector, in order of time:
    `together`, `minutes` (since the first exposure of the orbit, mean), `exposure` (text; the
    first of the group), `detector_id`, `n` (measurements), and for x and y of the focal plane
    `shift_x_mpix`, `sigma_x_mpix` (expected by chance), `pull_x` (their ratio), `shift_x_mas`,
    `sigma_x_mas`
    """
    found = focal_residuals(result, instrument)
    left = found.weight * (1.0 - _absorbed(found, len(result.exposures)))
    tables = []
    for number in together:
        groups, group_of = _groups(result.exposures, number)
        tables.append(_shifts(found, left, instrument, groups, group_of).assign(together=number))
    return pd.concat(tables, ignore_index=True)


class ShiftStatistics(NamedTuple):
    """Summary of the rows of a table of `detector_shifts` with one value of `together`.

    Attributes
    ----------
    values : number of shifts, both axes
    sigma_mpix, sigma_mas : median by chance
    beyond : number of shifts beyond two sigma
    expected : the number beyond two sigma by chance
    largest : largest shift over its sigma, absolute value
    limit : what the largest of so many exceeds in 1 % of orbits by chance
    """

    values: int
    sigma_mpix: float
    sigma_mas: float
    beyond: int
    expected: float
    largest: float
    limit: float


def shift_statistics(table: pd.DataFrame) -> ShiftStatistics:
    """Return the summary of rows of `detector_shifts`, of which there is at least one."""
    pulls = np.abs(table[["pull_x", "pull_y"]].to_numpy())
    return ShiftStatistics(
        values=pulls.size,
        sigma_mpix=float(np.median(table[["sigma_x_mpix", "sigma_y_mpix"]])),
        sigma_mas=float(np.median(table[["sigma_x_mas", "sigma_y_mas"]])),
        beyond=int((pulls > _BAND_SIGMAS).sum()),
        expected=0.0455 * pulls.size,
        largest=float(pulls.max()),
        limit=largest_by_chance(pulls.size),
    )


def _shifts(
    found: FocalResiduals,
    left: np.ndarray,
    instrument: Instrument,
    groups: pd.DataFrame,
    group_of: np.ndarray,
) -> pd.DataFrame:
    """Return the shifts in groups of exposures.

    Parameters
    ----------
    left : weight times the share that the exposures' parameters leave, shape (n, 2)
    groups : as from `_groups`
    group_of : of each exposure
    """
    ids = [detector.detector_id for detector in instrument.detectors]
    cells, size = group_of[found.exposure] * len(ids) + found.detector, len(groups) * len(ids)
    table = groups.loc[np.repeat(groups.index, len(ids))].reset_index(drop=True)
    table["detector_id"] = np.tile(ids, len(groups))
    table["n"] = np.bincount(cells, minlength=size)
    weight, sums = found.weight, found.weight * found.vector
    totals, lefts, residuals = (
        np.stack([np.bincount(cells, of_axis, minlength=size) for of_axis in values.T], axis=-1)
        for values in (weight, left, sums)
    )
    by_sources = found.kept_by_sources(cells, size) / np.where(totals > 0.0, totals, 1.0)
    free = lefts * by_sources
    is_known = (totals > 0.0).all(axis=1) & (free >= _LEAST_SHARE * totals).all(axis=1)
    known, free, residuals = table[is_known].copy(), free[is_known], residuals[is_known]
    for number, axis in enumerate("xy"):
        known[f"shift_{axis}_mpix"] = residuals[:, number] / free[:, number]
        known[f"sigma_{axis}_mpix"] = 1.0 / np.sqrt(free[:, number])
        known[f"pull_{axis}"] = residuals[:, number] / np.sqrt(free[:, number])
        for name in (f"shift_{axis}", f"sigma_{axis}"):
            known[f"{name}_mas"] = known[f"{name}_mpix"] * found.mas_per_mpix
    return known


def _groups(exposures: pd.DataFrame, together: int) -> tuple[pd.DataFrame, np.ndarray]:
    """Return groups of successive exposures in order of time, and that of each exposure."""
    rows = exposures.reset_index(drop=True).sort_values("obstime", kind="stable")
    visit = (rows["field_id"] != rows["field_id"].shift()).cumsum()
    number = rows.groupby(visit).cumcount() // together
    group = ((visit != visit.shift()) | (number != number.shift())).cumsum() - 1
    minutes = minutes_since_first(rows)
    named = rows.assign(minutes=minutes, exposure=exposure_labels(rows)).groupby(group.to_numpy())
    groups = named.agg(minutes=("minutes", "mean"), exposure=("exposure", "first"))
    return groups, group.sort_index().to_numpy()


def _absorbed(found: FocalResiduals, n_exposures: int) -> np.ndarray:
    """Return the share of a detector's shift that its exposure's parameters absorb, (n, 2).

    Pointing, roll and focal length are fitted to the residuals of all detectors of the exposure:
    two shifts, a turn and a change of scale.
    """
    n_detectors = int(found.detector.max(initial=0)) + 1
    cells, size = found.exposure * n_detectors + found.detector, n_exposures * n_detectors
    moves = _exposure_moves(found)
    # Of the shift of each detector along x and along y with each move, shape (2, moves, cells).
    of_cells = np.array(
        [
            [np.bincount(cells, free * move[axis], minlength=size) for move in moves]
            for axis, free in enumerate(found.free_weight.T)
        ]
    )
    normal = _normal_equations(found, moves, n_exposures)
    inverse = np.repeat(np.linalg.pinv(normal, hermitian=True), n_detectors, axis=0)
    taken = np.einsum("ais,sij,ajs->as", of_cells, inverse, of_cells)
    weights = np.stack([of_cells[0, 0], of_cells[1, 1]])
    share = np.divide(taken, weights, out=np.ones_like(taken), where=weights > 0.0)
    return share[:, cells].T


def _exposure_moves(found: FocalResiduals) -> list[_Move]:
    """Return how each parameter of an exposure moves its measurements, one unit each."""
    x, y = found.at.T
    one, zero = np.ones(len(x)), np.zeros(len(x))
    return [(one, zero), (zero, one), (-y, x), (x, y)]


def _normal_equations(
    found: FocalResiduals, moves: Sequence[_Move], n_exposures: int
) -> np.ndarray:
    """Return the normal equations of each exposure, shape (exposures, moves, moves)."""
    free_x, free_y = found.free_weight.T
    normal = np.empty((n_exposures, len(moves), len(moves)))
    for i, (x_i, y_i) in enumerate(moves):
        for j, (x_j, y_j) in enumerate(moves[: i + 1]):
            products = free_x * x_i * x_j + free_y * y_i * y_j
            sums = np.bincount(found.exposure, products, minlength=n_exposures)
            normal[:, i, j] = normal[:, j, i] = sums
    return normal
