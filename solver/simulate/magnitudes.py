"""Magnitudes of the stars, and how the noise of a measurement depends on them."""

import numpy as np
from jaxtyping import Float

# Star counts grow as 10^(0.35 G) between these magnitudes.
MAGNITUDES = (8.0, 19.5)
_COUNT_SLOPE = 0.35

# Chosen: the magnitude at which a measurement has the uncertainty of the settings, near the
# median of the synthetic stars, and the share of it that does not depend on the flux.
NOISE_MAGNITUDE = 17.0
NOISE_FLOOR = 0.25


def draw_magnitudes(rng: np.random.Generator, size: int) -> Float[np.ndarray, " n"]:
    """Draw magnitudes from the luminosity function."""
    low, high = (10.0 ** (_COUNT_SLOPE * limit) for limit in MAGNITUDES)
    return np.log10(rng.uniform(low, high, size)) / _COUNT_SLOPE


def noise_factor(magnitude: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Return the uncertainty of a measurement over that at `NOISE_MAGNITUDE`.

    The part that is not constant is photon noise, inversely proportional to the root of the flux.
    """
    photons = 10.0 ** (0.4 * (magnitude - NOISE_MAGNITUDE))
    return np.sqrt(NOISE_FLOOR**2 + (1.0 - NOISE_FLOOR**2) * photons)
