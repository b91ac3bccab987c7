"""Products of the patterns with the residuals, over all measurements."""

import numpy as np
from numpy.polynomial import legendre

from solver.results.diagnosis.patterns import Patterns, cell_of
from solver.results.diagnosis.rows import Rows


def products(patterns: Patterns, rows: Rows) -> np.ndarray:
    """Return the products of all patterns with the weighted residuals, um^-1, shape (columns,).

    A pattern is a function of the place times one of the time: the functions of the place are
    summed over each exposure.
    """
    vector = rows.weight * rows.residual.T
    turn = patterns.camera.turn
    c, s = rows.of_detectors(np.stack([np.cos(turn), np.sin(turn)]))
    on_detector = c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]
    by_exposure = [
        _of_terms(patterns, rows, vector),
        _of_moves(patterns, rows, vector, on_detector),
    ]
    in_place = np.concatenate(by_exposure)
    is_in_place = patterns.place < len(in_place)
    in_time = patterns.times @ in_place.T
    cells, n_cells = cell_of(rows), patterns.n_cells
    of_cells = np.stack([np.bincount(cells, along, n_cells) for along in vector], axis=1)
    return np.concatenate(
        [
            in_time[patterns.time[is_in_place], patterns.place[is_in_place]],
            _of_pixels(patterns, rows, on_detector),
            of_cells.ravel(),
        ]
    )


def _of_terms(patterns: Patterns, rows: Rows, vector: np.ndarray) -> np.ndarray:
    """Return the products of the terms of the distortion, x and y of each, by exposure.

    Powers of the place are summed, and made Legendre polynomials afterwards.

    Parameters
    ----------
    vector : weighted residuals, shape (2, n)
    """
    size, n_exp = max(patterns.degrees) + 1, len(rows.first) - 1
    sums = np.empty((n_exp, 2, size, size))
    blocks = rows.blocks()
    most = max((rows.first[b.stop] - rows.first[b.start] for b in blocks), default=0)
    # Seven digits are plenty for a sum that noise dominates, and take half the time.
    single = np.float32
    powers = np.empty((3, size, most), dtype=single)
    for block in blocks:
        of_block = slice(rows.first[block.start], rows.first[block.stop])
        x, y = rows.at[of_block].T.astype(single)
        along, in_y = powers[:2, :, : len(x)], powers[2, :, : len(x)]
        along[:, 0], in_y[0] = vector[:, of_block], 1.0
        for k in range(1, size):
            np.multiply(along[:, k - 1], x, out=along[:, k])
            np.multiply(in_y[k - 1], y, out=in_y[k])
        for e in block:
            own = slice(*(rows.first[e : e + 2] - of_block.start))
            sums[e] = along[:, :, own] @ in_y[:, own].T
    polynomials = np.zeros((size, size))
    for degree in range(size):
        polynomials[degree, : degree + 1] = legendre.leg2poly(np.eye(size)[degree, : degree + 1])
    found = polynomials @ sums @ polynomials.T
    return np.concatenate([found[:, :, k, j].T for k, j in patterns.terms])


def _of_moves(
    patterns: Patterns, rows: Rows, vector: np.ndarray, on_detector: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return the products of the shifts and the turn of each detector, by exposure."""
    n_det, n_exp = len(patterns.camera.turn), len(rows.first) - 1
    turned = rows.local[:, 0] * on_detector[1] - rows.local[:, 1] * on_detector[0]
    sums = np.zeros((n_det, 3, n_exp))
    for number, one in enumerate((*vector, turned)):
        sums[rows.detector[rows.runs], number, rows.exposure[rows.runs]] = rows.in_runs(one)
    return sums.reshape(-1, n_exp)


def _of_pixels(
    patterns: Patterns, rows: Rows, on_detector: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return the products of the functions of the pixel phase and of the magnitude."""
    found = []
    for axis, along in enumerate(on_detector):
        # Seven digits of the place within the pixel are plenty, and take a tenth of the time.
        angle, pixel = np.empty(rows.n, dtype=np.float32), rows.pixel[:, axis]
        np.subtract(pixel, np.rint(pixel), out=angle, casting="same_kind")
        angle *= 2.0 * np.pi
        single = along.astype(np.float32)
        found += [np.sin(angle) @ single, np.cos(angle) @ single]
    if patterns.has_magnitude:
        faintness = patterns.faintness.take(rows.source)
        for axis, along in enumerate(on_detector):
            found += [faintness @ along, (faintness * rows.local[:, axis]) @ along]
    return np.array(found)
