"""Padding of arrays to a few fixed shapes, because JAX compiles once for each shape."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Shaped

_LEAST_SOURCES, _EXPOSURES = 1024, 16


def pad(
    values: Shaped[np.ndarray, "n ..."], axis: str, sizes: Mapping[str, int]
) -> Shaped[np.ndarray, "m ..."]:
    """Return `values` padded to the size of their axis, if `sizes` has one for it.

    No measurement depends on the padding, which repeats the last row; added coefficients are
    zero, because they act on all measurements.
    """
    missing = max(sizes.get(axis, 0) - len(values), 0)
    padding = np.zeros(missing) if axis == "coef" else np.repeat(values[-1:], missing, axis=0)
    return np.concatenate([values, padding])


def padded_sources(number: int) -> int:
    """Return the next power of two: the orbits of a survey then have one or two of them."""
    return max(_LEAST_SOURCES, 1 << (number - 1).bit_length())


def padded_exposures(number: int) -> int:
    """Return the number of exposures, rounded up to the next multiple of `_EXPOSURES`."""
    return -(-number // _EXPOSURES) * _EXPOSURES
