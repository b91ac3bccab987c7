"""Simple structure: axes in which several symmetric matrices are as diagonal as possible.

Where eigenvalues coincide, eigenvectors are arbitrary axes of their space. Axes that also make
further matrices as diagonal as possible are well defined and can be named (joint
diagonalisation by plane rotations, after Cardoso and Souloumiac 1996).
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int

from solver.runtime.interruption import give_way

_MIN_ANGLE = 1e-9
_MAX_SWEEPS = 60
# The first and the second axis of each pair that is rotated.
_Round = tuple[Int[np.ndarray, " pair"], Int[np.ndarray, " pair"]]


def joint_axes(
    matrices: Float[np.ndarray, "matrix n n"],
) -> Float[np.ndarray, "n n"]:
    """Return the orthonormal axes, as columns, that maximise the squares on the diagonals.

    Parameters
    ----------
    matrices : symmetric matrices
    """
    axes = np.eye(matrices.shape[-1])
    rounds = list(_rounds(len(axes)))
    for _ in range(_MAX_SWEEPS):
        give_way()
        matrices, axes, largest = _swept(matrices, axes, rounds)
        if largest < _MIN_ANGLE:
            break
    return axes


def _rounds(n: int) -> Iterator[_Round]:
    """Yield every pair of n axes once, in rounds of disjoint pairs, which rotate at once.

    As in a tournament of n players: one stays, the others move on by one place after each round.
    """
    places = np.arange(n + n % 2)
    for _ in range(len(places) - 1):
        a, b = places[: len(places) // 2], places[len(places) // 2 :][::-1]
        # With an odd number, one axis has none to be paired with.
        is_pair = np.maximum(a, b) < n
        yield a[is_pair], b[is_pair]
        places = np.concatenate([places[:1], np.roll(places[1:], 1)])


def _swept(
    matrices: Float[np.ndarray, "matrix n n"],
    axes: Float[np.ndarray, "n n"],
    rounds: list[_Round],
) -> tuple[Float[np.ndarray, "matrix n n"], Float[np.ndarray, "n n"], float]:
    """Return the matrices and the axes after every pair was rotated, and the largest angle."""
    largest, unit = 0.0, np.eye(len(axes))
    for a, b in rounds:
        difference, mixed = matrices[:, a, a] - matrices[:, b, b], 2.0 * matrices[:, a, b]
        gain = 2.0 * (difference * mixed).sum(axis=0)
        loss = (difference**2 - mixed**2).sum(axis=0)
        angles = 0.25 * np.arctan2(gain, loss)
        rotation = unit.copy()
        rotation[a, a] = rotation[b, b] = np.cos(angles)
        rotation[b, a] = np.sin(angles)
        rotation[a, b] = -rotation[b, a]
        matrices, axes = rotation.T @ matrices @ rotation, axes @ rotation
        largest = max(largest, float(np.abs(angles).max(initial=0.0)))
    return matrices, axes, largest
