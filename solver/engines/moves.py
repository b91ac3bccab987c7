"""Moves of detectors within a field: found where their residuals change.

A fit in which detectors move has one place of each detector per field. A detector may move at any
time; the exposures of one field then lie to both sides of its mean place. The change that explains
most is found, the field is divided there, and the fit is repeated, until none is left.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import chdtrc, fdtrc

from solver.data.detector_spans import Move, span_numbers, with_moves
from solver.data.instrument import Instrument
from solver.data.settings import FitSettings
from solver.engines.gauss_newton import Iteration, Mode, find_mode
from solver.engines.robust import whitened_residuals
from solver.errors import InputError
from solver.problem.problem import Problem, rebuilt

_MOST_MOVES = 8
# Mean number of moves per orbit that are found where no detector moves.
_FALSE_ALARMS = 1e-3
# Of a place along x and y and a turn.
_FREEDOM = 3.0
# Squared distance, in sigmas, beyond which a measurement is not used.
_FAR = 36.0
# Median of a chi2 with two degrees of freedom.
_MEDIAN_CHI2 = 1.3863


class _Sums(NamedTuple):
    """Products of a shift along x and y and a turn of each detector in each exposure.

    Attributes
    ----------
    gram : with each other, shape (detectors, exposures, 3, 3)
    along : with the residuals, shape (detectors, exposures, 3)
    """

    gram: Float[np.ndarray, "det exp 3 3"]
    along: Float[np.ndarray, "det exp 3"]


def find_moves(
    problem: Problem,
    instrument: Instrument,
    settings: FitSettings,
    progress: Callable[[Iteration], None] = lambda _: None,
) -> tuple[Move, ...]:
    """Return the moves of detectors within the fields, those that explain most first."""
    moves: tuple[Move, ...] = ()
    while len(moves) < _MOST_MOVES:
        mode = find_mode(problem, settings, progress)
        if mode.reduced is None:
            return moves
        move = _clearest(problem, _sums(problem, mode))
        if move is None:
            return moves
        exposures = with_moves(problem.exposures, (*moves, move))
        try:
            problem = rebuilt(replace(problem, exposures=exposures), instrument, settings)
        except InputError:
            # There are too few measurements for more parameters.
            return moves
        moves = (*moves, move)
    return moves


def _sums(problem: Problem, mode: Mode) -> _Sums:
    """Return the sums over the measurements that are not far off."""
    measurements = problem.measurements
    residual = whitened_residuals(problem, mode)
    squares = (residual**2).sum(axis=1)
    scale = max(float(np.median(squares)) / _MEDIAN_CHI2, 1.0)
    near = squares < _FAR * scale
    at = measurements.measured / np.abs(measurements.measured).max(initial=1.0)
    # Of each axis: place along x, along y, and turn, over the uncertainty.
    none, one = np.zeros(len(at)), np.ones(len(at))
    columns = (
        np.stack([np.stack([one, none, -at[:, 1]]), np.stack([none, one, at[:, 0]])])
        / measurements.sigma.T[:, None]
        * near
    )
    shape = measurements.n_det, len(problem.exposures)
    group = measurements.index.detector * shape[1] + measurements.index.exposure

    def total(values: Float[np.ndarray, " obs"]) -> Float[np.ndarray, "det exp"]:
        return np.bincount(group, values, shape[0] * shape[1]).reshape(shape)

    gram = [
        [total((columns[:, i] * columns[:, j]).sum(axis=0)) for j in range(3)] for i in range(3)
    ]
    along = [total((columns[:, i] * residual.T).sum(axis=0)) for i in range(3)]
    return _Sums(np.stack(gram).transpose(2, 3, 0, 1) * scale, np.stack(along, axis=-1))


def _clearest(problem: Problem, sums: _Sums) -> Move | None:
    """Return the move that explains most, or None if chance would make such."""
    exposures = problem.exposures
    spans, time = span_numbers(exposures), exposures["obstime"].to_numpy()
    gains, chances, after = [], [], []
    for span in range(spans.max() + 1):
        rows = np.flatnonzero(spans == span)
        rows = rows[np.argsort(time[rows], kind="stable")]
        gain, chance = _gains(_Sums(sums.gram[:, rows], sums.along[:, rows]))
        # Exposures of the same time are not divided.
        is_later = np.diff(time[rows]) > 0.0
        gains.append(gain[:, is_later])
        chances.append(chance[:, is_later])
        after.append(rows[1:][is_later])
    candidates, first = np.concatenate(gains, axis=1), np.concatenate(after)
    likely = np.concatenate(chances, axis=1) < _FALSE_ALARMS / max(candidates.size, 1)
    if not likely.any():
        return None
    best = np.argmax(np.where(likely, candidates, 0.0).max(axis=0))
    row = exposures.iloc[first[best]]
    return Move(int(row["field_id"]), int(row["plate_id"]), float(row["obstime"]))


def _gains(
    sums: _Sums,
) -> tuple[Float[np.ndarray, "det split"], Float[np.ndarray, "det split"]]:
    """Return how much chi2 falls if a detector moves between two exposures, and its chance.

    Where the single exposures scatter by more than their noise, both are in units of that: what
    changes in each exposure is no move.

    Parameters
    ----------
    sums : of the exposures of the span, in order of time
    """
    gram, along = sums.gram.cumsum(axis=1), sums.along.cumsum(axis=1)
    before, whole = _explained(gram, along), _explained(gram[:, -1:], along[:, -1:])
    after = _explained(gram[:, -1:] - gram, along[:, -1:] - along)
    each = _explained(sums.gram, sums.along).sum(axis=1, keepdims=True)
    n_measured = sums.gram.any(axis=(2, 3)).sum(axis=1, keepdims=True)
    freedom = np.maximum(_FREEDOM * (n_measured - 2), 1.0)
    scatter = np.maximum((each - before - after) / freedom, 1.0)
    gain = ((before + after - whole) / scatter)[:, :-1]
    # The scatter is itself uncertain.
    of_scattered = fdtrc(_FREEDOM, freedom, np.maximum(gain, 0.0) / _FREEDOM)
    return gain, np.where(scatter[:, :-1] > 1.0, of_scattered, chdtrc(_FREEDOM, gain))


def _explained(
    gram: Float[np.ndarray, "det exp 3 3"], along: Float[np.ndarray, "det exp 3"]
) -> Float[np.ndarray, "det exp"]:
    """Return the chi2 that a place and a turn explain; those not measured explain nothing."""
    inverse = np.linalg.pinv(gram, rcond=1e-9, hermitian=True)
    return np.einsum("dei,deij,dej->de", along, inverse, along)
