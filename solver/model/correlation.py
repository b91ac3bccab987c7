"""Correlations of the five astrometric parameters, from the columns of a catalogue."""

from itertools import combinations

import numpy as np
import pandas as pd
from jaxtyping import Float

ASTROMETRY = ("ra", "dec", "parallax", "pmra", "pmdec")
CORRELATIONS = tuple(f"{first}_{second}_corr" for first, second in combinations(ASTROMETRY, 2))


def correlation_matrices(catalogue: pd.DataFrame) -> Float[np.ndarray, "src 5 5"]:
    """Return the correlation matrix of each source, in the order of `ASTROMETRY`.

    Parameters
    ----------
    catalogue : table with the columns `CORRELATIONS`
    """
    matrices = np.tile(np.eye(5), (len(catalogue), 1, 1))
    for (i, j), name in zip(combinations(range(5), 2), CORRELATIONS, strict=True):
        matrices[:, i, j] = matrices[:, j, i] = catalogue[name].to_numpy()
    return matrices


def square_roots(matrices: Float[np.ndarray, "src n n"]) -> Float[np.ndarray, "src n n"]:
    """Return the symmetric square root of each correlation or covariance matrix.

    Unlike a Cholesky factor it does not depend on the order of the parameters. Negative
    eigenvalues, which come from rounded correlations, are set to zero.
    """
    values, vectors = np.linalg.eigh(matrices)
    scaled = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    return scaled @ vectors.transpose(0, 2, 1)
