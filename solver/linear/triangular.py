"""Triangular systems: 2 x 2 ones of each source, and those of the whole calibration."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float

# Parts of a triangular product: more skip more zeros, but make smaller products.
_PARTS = 4


def lower_solve(
    factor: Float[np.ndarray, "src 2 2"], right: Float[np.ndarray, "*k 2 src"]
) -> Float[np.ndarray, "*k 2 src"]:
    """Solve L x = right for the 2 x 2 lower triangle L of each source, k right sides at once."""
    solved, (first, below, second) = np.empty(right.shape), _triangle(factor)
    np.divide(right[..., 0, :], first, out=solved[..., 0, :])
    np.multiply(solved[..., 0, :], -below, out=solved[..., 1, :])
    solved[..., 1, :] += right[..., 1, :]
    solved[..., 1, :] /= second
    return solved


def upper_solve(
    factor: Float[np.ndarray, "src 2 2"], right: Float[np.ndarray, "*k 2 src"]
) -> Float[np.ndarray, "*k 2 src"]:
    """Solve L' x = right for the 2 x 2 lower triangle L of each source, as `lower_solve`."""
    solved, (first, below, second) = np.empty(right.shape), _triangle(factor)
    np.divide(right[..., 1, :], second, out=solved[..., 1, :])
    np.multiply(solved[..., 1, :], -below, out=solved[..., 0, :])
    solved[..., 0, :] += right[..., 0, :]
    solved[..., 0, :] /= first
    return solved


def _triangle(factor: Float[np.ndarray, "src 2 2"]) -> Float[np.ndarray, "3 src"]:
    """Return the entries of the triangles, each contiguous, which makes row loops twice as fast."""
    return np.stack([factor[:, 0, 0], factor[:, 1, 0], factor[:, 1, 1]])


def rows_solved(
    factor: Float[np.ndarray, "k k"],
    right: Float[np.ndarray, "k 2 n"],
    trans: bool,
    scale: float = 1.0,
) -> Float[np.ndarray, "k 2 n"]:
    """Return scale R^-1 (or R'^-1) times the rows of `right`, which is overwritten."""
    rows = right.reshape(len(factor), -1)
    # Solved from the right for the transpose, which has the memory order of BLAS.
    solved = sl.blas.dtrsm(scale, factor, rows.T, trans_a=not trans, side=1, overwrite_b=True)
    return solved.T.reshape(right.shape)


def upper_times(
    upper: Float[np.ndarray, "k k"], right: Float[np.ndarray, "k n"]
) -> Float[np.ndarray, "k n"]:
    """Return the product with an upper triangle, without most of its zeros.

    Unlike SciPy's, it lets other threads work.
    """
    product = np.empty_like(right)
    for first, end in _parts(len(upper)):
        np.matmul(upper[first:end, first:], right[first:], out=product[first:end])
    return product


def upper_transposed_times(
    upper: Float[np.ndarray, "k k"], right: Float[np.ndarray, "k n"]
) -> Float[np.ndarray, "k n"]:
    """Return the product with the transpose of an upper triangle, as `upper_times`."""
    product = np.empty_like(right)
    for first, end in _parts(len(upper)):
        np.matmul(upper[:end, first:end].T, right[:end], out=product[first:end])
    return product


def _parts(size: int) -> Iterator[tuple[int, int]]:
    return pairwise(np.linspace(0, size, _PARTS + 1).astype(int).tolist())
