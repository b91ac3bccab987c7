"""How the magnitude of a star scales what faint stars suffer more from."""

import numpy as np

REFERENCE_MAGNITUDE = 17.0
"""Magnitude at which a shift by magnitude has the size of its parameter."""


def faintness(magnitude: np.ndarray) -> np.ndarray:
    """Return flux^(-1/2) of stars, one at `REFERENCE_MAGNITUDE` and zero without a magnitude.

    Parameters
    ----------
    magnitude : of each star, NaN where it is not known, shape (src,)
    """
    return np.nan_to_num(10.0 ** (0.2 * (magnitude - REFERENCE_MAGNITUDE)))
