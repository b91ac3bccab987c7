"""How the magnitude of a star scales what faint stars suffer more from."""

import numpy as np
from jaxtyping import Float

REFERENCE_MAGNITUDE = 17.0
"""Magnitude at which a shift by magnitude has the size of its parameter."""


def faintness(magnitude: Float[np.ndarray, " src"]) -> Float[np.ndarray, " src"]:
    """Return flux^(-1/2) of stars, one at `REFERENCE_MAGNITUDE` and zero without a magnitude."""
    return np.nan_to_num(10.0 ** (0.2 * (magnitude - REFERENCE_MAGNITUDE)))
