"""Simple structure: the axes in which several symmetric matrices are as diagonal as can be.

Where eigenvalues coincide, eigenvectors are any axes of their space. Those that are diagonal
in further matrices as well, as far as one set of axes can be, are the ones that can be told
apart and named (joint diagonalisation by plane rotations, after Cardoso and Souloumiac 1996).
"""

from itertools import combinations

import numpy as np
from jaxtyping import Float

_SMALLEST_TURN = 1e-9
_MOST_SWEEPS = 60


def joint_axes(
    matrices: Float[np.ndarray, "matrix n n"],
) -> Float[np.ndarray, "n n"]:
    """Return the orthonormal axes, as columns, that maximise the squares on the diagonals.

    Parameters
    ----------
    matrices : symmetric
    """
    turned, axes = matrices.copy(), np.eye(matrices.shape[-1])
    for _ in range(_MOST_SWEEPS):
        angles = [_turn(turned, axes, a, b) for a, b in combinations(range(len(axes)), 2)]
        if max(map(abs, angles), default=0.0) < _SMALLEST_TURN:
            break
    return axes


def _turn(
    matrices: Float[np.ndarray, "matrix n n"], axes: Float[np.ndarray, "n n"], a: int, b: int
) -> float:
    """Turn axes a and b in their plane, in place, and return the angle."""
    unlike, mixed = matrices[:, a, a] - matrices[:, b, b], 2.0 * matrices[:, a, b]
    gain, loss = 2.0 * (unlike @ mixed), unlike @ unlike - mixed @ mixed
    angle = 0.25 * float(np.arctan2(gain, loss))
    plane, c, s = [a, b], np.cos(angle), np.sin(angle)
    turn = np.array([(c, -s), (s, c)])
    axes[:, plane] = axes[:, plane] @ turn
    matrices[:, :, plane] = matrices[:, :, plane] @ turn
    matrices[:, plane, :] = turn.T @ matrices[:, plane, :]
    return angle
