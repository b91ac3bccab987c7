"""What a fit leaves of the sums of weighted residuals in bins."""

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np

from plateviz.tables.focal_residuals import FocalResiduals
from solver.data.distortion_terms import terms
from solver.data.result import FitResult
from solver.units import UM_PER_MM

# Measurements that stand for all where the share of the calibration is computed.
_ENOUGH = 4_000
# Calibration parameters that the prior holds by more than this share absorb next to nothing.
_HELD = 0.5
# Eigenvalues below this share of the largest count as zero in a pseudo-inverse.
_RCOND = 1e-9

# Displacements of some measurements along x and y of the focal plane, each of shape (m,).
_Move = tuple[np.ndarray, np.ndarray]


class _Calibration(NamedTuple):
    """What detectors and distortion can displace, at some of the measurements.

    Attributes
    ----------
    rows : these measurements, shape (m,)
    moves : weighted displacements by each free parameter along x and along y of the detectors,
        two arrays of shape (m, parameters)
    inverse : of the normal equations of the parameters, shape (parameters, parameters)
    """

    rows: np.ndarray
    moves: list[np.ndarray]
    inverse: np.ndarray


class BinShares:
    """What a fit leaves of the sum of weighted residuals along an axis of the detectors in bins.

    If all measurements of a bin are displaced by as much, the parameters of the fit follow, and a
    share of the sum is left. It is the variance of the sum over that of independent residuals,
    too. The share is the product of what the positions of the sources leave and of what the
    exposures or the calibration leave: of these two the one that absorbs more, because the mean
    over all bins is absorbed by either.

    Parameters
    ----------
    result : the fit
    found : its residuals
    turn : rotation of the detector of each measurement, rad, shape (n,)
    """

    def __init__(self, result: FitResult, found: FocalResiduals, turn: np.ndarray) -> None:
        self._result, self._found, self._turn = result, found, turn
        self._weight = found.weight.mean(axis=1)
        (x, y), c, s = found.at.T, np.cos(turn), np.sin(turn)
        # Along and across the x axis of the detector: a unit along x, and the place.
        units = [c, -s, c * x - s * y, s * x + c * y]
        self._along = [self._weight * one for one in units]

    def __call__(self, cells: np.ndarray, size: int) -> np.ndarray:
        """Return the share of each bin that is left, along x and y of the detectors, (size, 2).

        Parameters
        ----------
        cells : bin of each measurement, shape (n,); those that are `size` are in none
        size : number of bins
        """
        total = np.bincount(cells, self._weight, minlength=size + 1)[:size]
        total = np.where(total > 0.0, total, 1.0)[:, None]
        taken = np.maximum(self._by_exposures(cells, size), self._by_calibration(cells, size))
        return np.clip((1.0 - taken / total) * (1.0 - self._by_sources(cells, size) / total), 0, 1)

    def _by_sources(self, cells: np.ndarray, size: int) -> np.ndarray:
        """Return what the positions of the sources absorb of the weights, both axes alike."""
        variance = self._found.source_variance
        sums = self._sums(self._found.source, len(variance), cells, size, self._along[:2])
        return np.einsum("kbs,s->b", np.square(sums), variance)[:, None]

    def _by_exposures(self, cells: np.ndarray, size: int) -> np.ndarray:
        """Return what pointing, roll and focal length of the exposures absorb of the weights."""
        normal = self._normal_of_exposures
        x, y, along, across = self._sums(
            self._found.exposure, len(normal), cells, size, self._along
        )
        inverse = np.linalg.pinv(normal, rcond=_RCOND, hermitian=True)
        moves = [np.stack(one, axis=-1) for one in ((x, y, -across, along), (-y, x, along, across))]
        return np.stack([np.einsum("bei,eij,bej->b", m, inverse, m) for m in moves], axis=-1)

    @cached_property
    def _normal_of_exposures(self) -> np.ndarray:
        """Normal equations of shift in x and y, roll and scale of each exposure, (exp, 4, 4)."""
        exposure, (x, y) = self._found.exposure, self._found.at.T
        n = len(self._result.exposures)
        one, sum_x, sum_y, squares = (
            np.bincount(exposure, self._weight * value, minlength=n)
            for value in (np.ones(len(x)), x, y, x**2 + y**2)
        )
        none = np.zeros(n)
        rows = [
            [one, none, -sum_y, sum_x],
            [none, one, sum_x, sum_y],
            [-sum_y, sum_x, squares, none],
            [sum_x, sum_y, none, squares],
        ]
        return np.array(rows).transpose(2, 0, 1)

    def _sums(
        self, item: np.ndarray, n_items: int, cells: np.ndarray, size: int, values: list[np.ndarray]
    ) -> np.ndarray:
        """Return the sums of each of the values in each bin and item, (values, size, items)."""
        pair, n_pairs = cells * n_items + item, (size + 1) * n_items
        sums = [np.bincount(pair, one, minlength=n_pairs)[: size * n_items] for one in values]
        return np.array(sums).reshape(len(values), size, n_items)

    def _by_calibration(self, cells: np.ndarray, size: int) -> np.ndarray:
        """Return what detectors and distortion absorb of the weights, if free."""
        rows, moves, inverse = self._calibration
        inside = (cells[rows] == np.arange(size)[:, None]).astype(float)
        factor = len(cells) / max(len(rows), 1)
        sums = [inside @ of_axis for of_axis in moves]
        return factor * np.stack([np.einsum("bi,ij,bj->b", m, inverse, m) for m in sums], axis=-1)

    @cached_property
    def _calibration(self) -> _Calibration:
        rows = np.arange(0, len(self._found), max(1, len(self._found) // _ENOUGH))
        # Along x and y of the focal plane, shape (2, m, parameters).
        design = np.array(list(self._moves(rows))).transpose(1, 2, 0)
        weight, c, s = (
            v[rows, None] for v in (self._weight, np.cos(self._turn), np.sin(self._turn))
        )
        normal = np.einsum("ank,anl->kl", weight * design, design, optimize=True)
        # Parameters of one scale, so that `_RCOND` means the same for each.
        scales = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
        inverse = np.linalg.pinv(normal * np.outer(scales, scales), rcond=_RCOND, hermitian=True)
        along = [c * design[0] - s * design[1], s * design[0] + c * design[1]]
        return _Calibration(
            rows, [weight * one for one in along], inverse * np.outer(scales, scales)
        )

    def _moves(self, rows: np.ndarray) -> Iterator[_Move]:
        """Yield the displacements of some measurements by each parameter that is free."""
        at = self._found.at[rows]
        scale = float(self._result.summary.get("distortion_scale_um", 0.0)) / UM_PER_MM
        x, y = (at / (scale or max(float(np.abs(at).max(initial=0.0)), 1.0))).T
        one, none = np.ones(len(x)), np.zeros(len(x))
        # Those of all detectors together.
        yield from ((one, none), (none, one), (-y, x), (x, y))
        yield from self._detector_moves(rows, x, y)
        yield from self._distortion_moves(x, y)

    def _detector_moves(self, rows: np.ndarray, x: np.ndarray, y: np.ndarray) -> Iterator[_Move]:
        """Yield the shifts and the turn of each detector, unless the prior holds them."""
        shares = self._result.values_on("det", "prior_share")
        one, none = np.ones(len(x)), np.zeros(len(x))
        for name, (along_x, along_y) in (
            ("detector_x", (one, none)),
            ("detector_y", (none, one)),
            ("detector_rotation", (-y, x)),
        ):
            for number in np.flatnonzero(shares[name].to_numpy() < _HELD):
                on = self._found.detector[rows] == number
                yield along_x * on, along_y * on

    def _distortion_moves(self, x: np.ndarray, y: np.ndarray) -> Iterator[_Move]:
        """Yield the terms of the distortion, along x and along y, unless the prior holds them."""
        shares, order = self._result.values_on("coef", "prior_share"), self._result.settings.order
        products = np.polynomial.legendre.legvander2d(x, y, [order, order])
        none = np.zeros(len(x))
        # A fit of order 0 or 1 has no such terms.
        held = shares.reindex(columns=["distortion_x", "distortion_y"]).to_numpy()
        for (i, j), (held_x, held_y) in zip(terms(order), held, strict=True):
            term = products[:, i * (order + 1) + j]
            if held_x < _HELD:
                yield term, none
            if held_y < _HELD:
                yield none, term
