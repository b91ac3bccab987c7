"""Defects of the observer: the satellite's velocity left out, and wrong times of exposures."""

import erfa
import numpy as np
import pandas as pd

from solver.simulate.defects.defect import AppliedDefect
from solver.simulate.defects.distortion_terms import ORBITAL_PERIOD_S
from solver.units import SECONDS_PER_DAY

_MJD_ZERO = 2400000.5
_VELOCITY = ["satellite_vx", "satellite_vy", "satellite_vz"]


def satellite_velocity(applied: AppliedDefect, attitude: pd.DataFrame) -> pd.DataFrame:
    """Move the observer on a circular orbit about the Earth, which the table does not tell.

    The orbit is that of a dawn-to-dusk satellite: its plane is at right angles to the Sun. The
    phase is random.
    """
    time = attitude["obstime"].to_numpy()
    heliocentric, _ = erfa.epv00(*erfa.tcbtdb(_MJD_ZERO, time.mean()))
    sun = -heliocentric["p"] / np.linalg.norm(heliocentric["p"])
    first = np.cross([0.0, 0.0, 1.0], sun)
    first /= np.linalg.norm(first)
    second = np.cross(sun, first)
    turns = SECONDS_PER_DAY * (time - time.min()) / ORBITAL_PERIOD_S
    phase = 2.0 * np.pi * (turns + applied.orbit_rng().random())
    velocity = applied.amplitude * (
        np.cos(phase)[:, None] * first[None, :] + np.sin(phase)[:, None] * second[None, :]
    )
    return attitude.assign(**dict(zip(_VELOCITY, velocity.T, strict=True)))


def exposure_times(applied: AppliedDefect, exposures: pd.DataFrame) -> pd.DataFrame:
    """Record times that are too late."""
    return exposures.assign(obstime=exposures["obstime"] + applied.amplitude / SECONDS_PER_DAY)
