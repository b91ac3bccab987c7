"""Simple structure: axes in which several symmetric matrices are as diagonal as possible.

Where eigenvalues coincide, eigenvectors are arbitrary axes of their space. Axes that also make
further matrices as diagonal as possible are well defined and can be named (joint
diagonalisation by plane rotations, after Cardoso and Souloumiac 1996).
"""

from itertools import combinations

import numpy as np
from jaxtyping import Float

_MIN_ANGLE = 1e-9
_MAX_SWEEPS = 60


def joint_axes(
    matrices: Float[np.ndarray, "matrix n n"],
) -> Float[np.ndarray, "n n"]:
    """Return the orthonormal axes, as columns, that maximise the squares on the diagonals.

    Parameters
    ----------
    matrices : symmetric matrices
    """
    rotated, axes = matrices.copy(), np.eye(matrices.shape[-1])
    for _ in range(_MAX_SWEEPS):
        angles = [_rotate(rotated, axes, a, b) for a, b in combinations(range(len(axes)), 2)]
        if max(map(abs, angles), default=0.0) < _MIN_ANGLE:
            break
    return axes


def _rotate(
    matrices: Float[np.ndarray, "matrix n n"], axes: Float[np.ndarray, "n n"], a: int, b: int
) -> float:
    """Rotate axes a and b in their plane, in place, and return the angle."""
    difference, mixed = matrices[:, a, a] - matrices[:, b, b], 2.0 * matrices[:, a, b]
    gain, loss = 2.0 * (difference @ mixed), difference @ difference - mixed @ mixed
    angle = 0.25 * float(np.arctan2(gain, loss))
    plane, c, s = [a, b], np.cos(angle), np.sin(angle)
    rotation = np.array([(c, -s), (s, c)])
    axes[:, plane] = axes[:, plane] @ rotation
    matrices[:, :, plane] = matrices[:, :, plane] @ rotation
    matrices[:, plane, :] = rotation.T @ matrices[:, plane, :]
    return angle
