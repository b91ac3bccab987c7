"""Defects of the noise: its size over the stated uncertainty of each measurement."""

import numpy as np
from jaxtyping import Float

from solver.simulate.defects.defect import AppliedDefect, TrueRows
from solver.simulate.magnitudes import MAGNITUDES


def noise(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, " obs"]:
    """Return the same factor for all measurements."""
    return np.full(len(rows.exposure), 1.0 + applied.amplitude)


def noise_of_exposures(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, " obs"]:
    """Return a factor of each exposure, whose logarithm is normal."""
    deviates = applied.orbit_rng().standard_normal(len(rows.attitude))
    return np.exp(applied.amplitude * deviates)[rows.exposure]


def noise_of_magnitudes(applied: AppliedDefect, rows: TrueRows) -> Float[np.ndarray, " obs"]:
    """Return a factor that grows linearly with magnitude, one in the middle of their range."""
    low, high = MAGNITUDES
    part = np.clip((2.0 * rows.magnitude - (low + high)) / (high - low), -1.0, 1.0)
    return 1.0 + applied.amplitude * part
