"""Tests of the exposures one by one: patterns that each exposure may have of its own."""

from typing import NamedTuple

import numpy as np

from solver.results.diagnosis.rows import Rows

# Waves of the pointing while the rows of the detectors are read.
WAVES = 4
_SMOOTH = 6
_SIZE = _SMOOTH + 2 * WAVES
# Added to the diagonal, relative: an exposure with few measurements has fewer directions.
_RIDGE = 1e-6


class ExposureChi2(NamedTuple):
    """How much chi2 of each exposure would fall with patterns of its own, shape (exposures,).

    Attributes
    ----------
    stretch : focal lengths along x and y that differ, one degree of freedom
    shear : axes that are not at right angles, one
    quadratic : quadratic distortion, six
    swing : pointing that changes while the detectors are read, `4 WAVES`
    scale : chi2 of the exposure per degree of freedom, by which the others are divided
    """

    stretch: np.ndarray
    shear: np.ndarray
    quadratic: np.ndarray
    swing: np.ndarray
    scale: np.ndarray

    def with_others_of(self, other: "ExposureChi2", kept: np.ndarray) -> "ExposureChi2":
        """Return these of the exposures `kept`, given by their indices, and all else of `other`."""
        is_kept = np.isin(np.arange(len(self.scale)), kept)
        pairs = zip(self, other, strict=True)
        return ExposureChi2(*(np.where(is_kept, *pair) for pair in pairs))


def exposure_chi2(rows: Rows) -> ExposureChi2:
    """Return the chi2 of patterns of each exposure, with pointing, roll and scale fitted.

    The positions of the sources take a share of each residual, which the weights allow for. The
    chi2 are divided by that of the exposure per degree of freedom, unless that is below one, so
    that an exposure with more noise does not stand out.
    """
    gram, along = _sums(rows)
    turn, scale = [(2, 0, -1.0), (1, 1, 1.0)], [(1, 0, 1.0), (2, 1, 1.0)]
    base = _pairs([(0, 0, 1.0)], [(0, 1, 1.0)], turn, scale)
    stretch = _pairs([(1, 0, 1.0), (2, 1, -1.0)])
    shear = _pairs([(2, 0, 1.0), (1, 1, 1.0)])
    quadratic = _pairs(*([(i, axis, 1.0)] for i in range(3, _SMOOTH) for axis in (0, 1)))
    swing = _pairs(*([(i, axis, 1.0)] for i in range(_SMOOTH, _SIZE) for axis in (0, 1)))
    linear = np.concatenate([base, stretch, shear], axis=1)
    smooth = np.concatenate([linear, quadratic], axis=1)
    typical = _scale(rows)
    return ExposureChi2(
        _gain(gram, along, base, stretch) / typical,
        _gain(gram, along, base, shear) / typical,
        _gain(gram, along, linear, quadratic) / typical,
        _gain(gram, along, smooth, swing) / typical,
        typical,
    )


def _scale(rows: Rows) -> np.ndarray:
    """Return chi2 over its expected value of each exposure, at least one, without outliers."""
    kept = ~rows.is_far
    chi2 = rows.in_exposures(kept * rows.chi2)
    dof = 2.0 * rows.in_exposures(kept * rows.left)
    return np.maximum(chi2 / np.maximum(dof, 1e-9), 1.0)


def _sums(rows: Rows) -> tuple[np.ndarray, np.ndarray]:
    """Return the products of the scalar functions of each exposure, and with the residuals.

    Shapes (exposures, size, size) and (exposures, 2 size), those along x first.
    """
    n = len(rows.first) - 1
    gram, along = np.zeros((n, _SIZE, _SIZE)), np.zeros((n, 2 * _SIZE))
    # Seven digits are plenty for a pattern, and take half the time, or a tenth for its waves.
    single = np.float32
    read = (np.pi * (rows.local[:, 1] + 1.0)).astype(single)
    cosine, sine = np.cos(read), np.sin(read)
    root = np.sqrt(rows.weight * rows.left) * ~rows.is_far
    # Over that root, by which the functions are multiplied.
    used = np.divide(rows.weight, root, out=np.zeros(rows.n), where=root > 0.0)
    vector = used * rows.residual.T
    first, blocks = rows.first, rows.blocks()
    most = max((first[b.stop] - first[b.start] for b in blocks), default=0)
    buffer = np.empty((_SIZE + 3, most), dtype=single)
    for block in blocks:
        of_block = slice(first[block.start], first[block.stop])
        *_, double = whole = buffer[:, : of_block.stop - of_block.start]
        some, with_vector = whole[:_SIZE], whole[: _SIZE + 2]
        with_vector[_SIZE:] = vector[:, of_block]
        # All others follow from the weighted ones of degree 0 by steps that are linear in them.
        some[0] = root[of_block]
        x, y = rows.at[of_block].T.astype(single)
        np.multiply(some[0], x, out=some[1])
        np.multiply(some[0], y, out=some[2])
        np.multiply(some[1:3], x, out=some[3:5])
        np.multiply(some[2], y, out=some[5])
        cosines, sines = some[_SMOOTH : _SMOOTH + WAVES], some[_SMOOTH + WAVES :]
        np.multiply(some[0], cosine[of_block], out=cosines[0])
        np.multiply(some[0], sine[of_block], out=sines[0])
        np.add(cosine[of_block], cosine[of_block], out=double)
        # Harmonics of a wave by Chebyshev's recursion, from those of degree 0: one and zero.
        for waves, degree_0 in ((cosines, some[0]), (sines, 0.0)):
            for k in range(1, WAVES):
                np.multiply(double, waves[k - 1], out=waves[k])
                waves[k] -= waves[k - 2] if k > 1 else degree_0
        for e in block:
            own = slice(first[e] - of_block.start, first[e + 1] - of_block.start)
            # Not a matrix with its own transpose, which takes twice as long for so few functions.
            found = with_vector[:, own] @ some[:, own].T
            gram[e], along[e] = found[:_SIZE], found[_SIZE:].ravel()
    return gram, along


def _pairs(*columns: list[tuple[int, int, float]]) -> np.ndarray:
    """Return patterns as columns: coefficients of the functions along x, then along y."""
    found = np.zeros((2 * _SIZE, len(columns)))
    for number, parts in enumerate(columns):
        for function, axis, value in parts:
            found[axis * _SIZE + function, number] = value
    return found


def _gain(
    gram: np.ndarray, along: np.ndarray, fitted: np.ndarray, tested: np.ndarray
) -> np.ndarray:
    """Return how much chi2 of each exposure falls by the tested patterns after the fitted ones."""
    both = np.concatenate([fitted, tested], axis=1)
    halves = both.reshape(2, _SIZE, -1)
    along_x, along_y = halves
    matrix = along_x.T @ gram @ along_x + along_y.T @ gram @ along_y
    diagonal = np.einsum("epp->ep", matrix)
    diagonal += _RIDGE * diagonal.max(axis=1, keepdims=True) + 1e-300
    vector = along @ both
    n = fitted.shape[1]
    whole = np.einsum("ep,ep->e", vector, np.linalg.solve(matrix, vector[:, :, None])[:, :, 0])
    before = vector[:, :n]
    part = np.linalg.solve(matrix[:, :n, :n], before[:, :, None])[:, :, 0]
    return np.maximum(whole - np.einsum("ep,ep->e", before, part), 0.0)
